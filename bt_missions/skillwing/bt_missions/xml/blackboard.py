"""The blackboard of a tree file: named entries, and one set of names for every subtree."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

_NOTHING: Any = object()


class BlackboardEntry:
    """One entry. It holds what an option gave it before the flight, or asks `source` whenever it is read."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.source: Callable[[], Any] | None = None
        self.is_excused = False
        """Whether nobody can know yet what fills it, or that has been told already: then its lack is no problem."""
        self._value = _NOTHING

    @property
    def is_known(self) -> bool:
        """Whether its value is known before the flight, and stays."""
        return self.source is None and self._value is not _NOTHING

    @property
    def is_filled(self) -> bool:
        """Whether anything gives it a value, now or in flight."""
        return self.source is not None or self._value is not _NOTHING

    def excuse(self) -> BlackboardEntry:
        self.is_excused = True
        return self

    def hold(self, value: Any) -> BlackboardEntry:
        self._value = value
        return self

    def __call__(self) -> Any:
        """The value now. Raises LookupError where nothing has given one."""
        if self.source is not None:
            return self.source()
        if self._value is _NOTHING:
            raise LookupError(f"`{{{self.name}}}` has no value; let an option or an output port give it one.")
        return self._value


class Blackboard:
    """The names that one subtree sees. links: its ports, tied to entries outside; inherit: it sees all of `outer`;
    excused: it is that of a tree that nobody calls, and what a caller would fill is not missed."""

    def __init__(
        self,
        outer: Blackboard | None = None,
        links: Mapping[str, BlackboardEntry] | None = None,
        *,
        inherit: bool = False,
        excused: bool = False,
    ) -> None:
        self._outer = outer
        self._inherit = inherit
        self._excused = excused
        self._entries = dict(links or {})

    def entry(self, name: str) -> BlackboardEntry:
        """The entry of that name, made if there is none. `@name` is one of the main tree, from wherever it is used."""
        if name.startswith("@"):
            return self._outermost.entry(name[1:])
        if name not in self._entries:
            inherited = self._outer is not None and self._inherit and not name.startswith("_")
            self._entries[name] = self._outer.entry(name) if inherited and self._outer is not None else self._made(name)
        return self._entries[name]

    def _made(self, name: str) -> BlackboardEntry:
        return BlackboardEntry(name).excuse() if self._excused else BlackboardEntry(name)

    @property
    def _outermost(self) -> Blackboard:
        return self if self._outer is None else self._outer._outermost
