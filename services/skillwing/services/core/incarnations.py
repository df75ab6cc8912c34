"""Processes of one name, one after the other: the one that came last counts."""

from __future__ import annotations

from collections.abc import Iterable

from skillwing.services.core.bounded_dict import BoundedDict
from skillwing.services.core.refusal import RefusedError
from skillwing.services.core.snapshot import ManagerEntry, OnEntry
from skillwing.services.protocol import ErrorCode

INCARNATIONS_REMEMBERED = 1000


class Incarnations:
    """The latest incarnation of each manager, and those that it has replaced.

    on_entry: receives an entry for each new one; entries: from the snapshot.
    """

    def __init__(self, on_entry: OnEntry, entries: Iterable[ManagerEntry] = ()) -> None:
        self._on_entry = on_entry
        self._latest: BoundedDict[str, str] = BoundedDict(INCARNATIONS_REMEMBERED)
        self._replaced: BoundedDict[tuple[str, str], None] = BoundedDict(INCARNATIONS_REMEMBERED)
        for entry in entries:
            self._take(entry)

    def check(self, manager: str, incarnation: str) -> None:
        """Refuse a replaced one: its messages were delayed, or the process hung and woke up."""
        if (manager, incarnation) in self._replaced:
            text = f"Another process has taken the place of this `{manager}`."
            raise RefusedError(ErrorCode.REPLACED, text, help="End this process.")

    def check_attached(self, manager: str, incarnation: str) -> None:
        """Refuse any but the latest, whose predecessors hold no grants any more."""
        self.check(manager, incarnation)
        if self._latest.get(manager) != incarnation:
            text = f"This `{manager}` has not attached to the resource manager yet."
            raise RefusedError(ErrorCode.UNAVAILABLE, text, help="Attach, then ask again.")

    def note(self, manager: str, incarnation: str) -> None:
        """Take an incarnation for the latest."""
        if self._latest.get(manager) != incarnation:
            entry = ManagerEntry(manager, incarnation)
            self._take(entry)
            self._on_entry(entry)

    def _take(self, entry: ManagerEntry) -> None:
        before = self._latest.get(entry.manager)
        if before is not None:
            self._replaced[entry.manager, before] = None
        self._latest[entry.manager] = entry.incarnation
