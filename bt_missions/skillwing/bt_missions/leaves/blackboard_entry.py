"""Entries of a blackboard: named values that one leaf sets and others read."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

_NOTHING: Any = object()


class BlackboardEntry:
    """One entry: a constant from an option, or a value that `source` returns at each read."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.source: Callable[[], Any] | None = None
        self.may_be_empty = False
        """True if a missing value is no problem: the caller that sets it is unknown, or the problem is reported."""
        self._value = _NOTHING

    @property
    def is_constant(self) -> bool:
        """True if the value is known before the run, and stays."""
        return self.source is None and self._value is not _NOTHING

    @property
    def is_filled(self) -> bool:
        """True if it has a value, or gets one in the run."""
        return self.source is not None or self._value is not _NOTHING

    def allow_empty(self) -> BlackboardEntry:
        self.may_be_empty = True
        return self

    def set(self, value: Any) -> BlackboardEntry:
        self._value = value
        return self

    def __call__(self) -> Any:
        """The value now. Raises LookupError if there is none."""
        if self.source is not None:
            return self.source()
        if self._value is _NOTHING:
            raise LookupError(f"`{{{self.name}}}` has no value; let an option or an output port give it one.")
        return self._value
