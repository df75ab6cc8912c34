"""Blackboards of a tree file: named entries, and one set of names for each subtree."""

from __future__ import annotations

from collections.abc import Callable, Mapping
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


class Blackboard:
    """The names that one subtree sees. links: entries outside for its ports; inherit: it sees all names of `outer`.

    may_be_empty: of a tree without a caller; entries that a caller would set may stay empty.
    """

    def __init__(
        self,
        outer: Blackboard | None = None,
        links: Mapping[str, BlackboardEntry] | None = None,
        *,
        inherit: bool = False,
        may_be_empty: bool = False,
    ) -> None:
        self._outer = outer
        self._inherit = inherit
        self._may_be_empty = may_be_empty
        self._entries = dict(links or {})

    def entry(self, name: str) -> BlackboardEntry:
        """The entry of that name, made if there is none. `@name` means an entry of the main tree."""
        if name.startswith("@"):
            return self._outermost.entry(name[1:])
        if name not in self._entries:
            inherited = self._outer is not None and self._inherit and not name.startswith("_")
            self._entries[name] = self._outer.entry(name) if inherited and self._outer is not None else self._made(name)
        return self._entries[name]

    def _made(self, name: str) -> BlackboardEntry:
        return BlackboardEntry(name).allow_empty() if self._may_be_empty else BlackboardEntry(name)

    @property
    def _outermost(self) -> Blackboard:
        return self if self._outer is None else self._outer._outermost
