"""Blackboards of a tree file: one set of named entries for each subtree."""

from __future__ import annotations

from collections.abc import Mapping

from skillwing.bt_missions.leaves.blackboard_entry import BlackboardEntry


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
