"""Entries of a blackboard: named values that one leaf sets and others read."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

_NOTHING: Any = object()


class MissingValueError(LookupError):
    """A value that a leaf cannot read now. `str()` is the reason, without a full stop."""


class BlackboardEntry:
    """One entry: a constant from an option, or a value that `source` returns at each read.

    A leaf that writes the entry calls `announce` when it is built, and `write` in the run. The latest value counts.
    """

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

    @property
    def is_pending(self) -> bool:
        """True if it has no value until a leaf writes it."""
        return self._value is _NOTHING and self.source == self._constant

    def allow_empty(self) -> BlackboardEntry:
        self.may_be_empty = True
        return self

    def set(self, value: Any) -> BlackboardEntry:
        self._value = value
        return self

    def announce(self) -> None:
        """Note that a leaf writes this entry in the run. A read before that raises MissingValueError."""
        if self.source is None:
            self.source = self._constant

    def write(self, value: Any) -> None:
        """Set the value in the run."""
        self.source = lambda: value

    def __call__(self) -> Any:
        """The value now. Raises MissingValueError if there is none."""
        return self._constant() if self.source is None else self.source()

    def _constant(self) -> Any:
        if self._value is _NOTHING:
            raise MissingValueError(f"`{{{self.name}}}` has no value yet")
        return self._value
