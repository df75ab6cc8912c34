"""Processes of one name, one after the other: whichever came last is the one that counts."""

from __future__ import annotations

from collections.abc import Iterable

from skillwing.services.core.bounded_dict import BoundedDict
from skillwing.services.core.refusal import RefusedError
from skillwing.services.core.snapshot import ManagerEntry, OnEntry
from skillwing.services.protocol import ErrorCode

INCARNATIONS_REMEMBERED = 1000


class Incarnations:
    """The latest incarnation of each manager, and those that it has replaced.

    keep: told of each new one; kept: those that a predecessor of this process has told of.
    """

    def __init__(self, keep: OnEntry, kept: Iterable[ManagerEntry] = ()) -> None:
        self._keep = keep
        self._latest: BoundedDict[str, str] = BoundedDict(INCARNATIONS_REMEMBERED)
        self._replaced: BoundedDict[tuple[str, str], None] = BoundedDict(INCARNATIONS_REMEMBERED)
        for noted in kept:
            self._take(noted)

    def check(self, manager: str, incarnation: str) -> None:
        """Refuse one that has been replaced: its messages were under way for long, or it hung and woke up."""
        if (manager, incarnation) in self._replaced:
            text = f"Another process has taken the place of this `{manager}`."
            raise RefusedError(ErrorCode.REPLACED, text, help="End this process.")

    def check_attached(self, manager: str, incarnation: str) -> None:
        """Refuse any but the latest, whose predecessors hold nothing any more."""
        self.check(manager, incarnation)
        if self._latest.get(manager) != incarnation:
            text = f"This `{manager}` has not attached to the resource manager yet."
            raise RefusedError(ErrorCode.UNAVAILABLE, text, help="Attach, then ask again.")

    def note(self, manager: str, incarnation: str) -> None:
        """Take it for the latest."""
        if self._latest.get(manager) != incarnation:
            noted = ManagerEntry(manager, incarnation)
            self._take(noted)
            self._keep(noted)

    def _take(self, noted: ManagerEntry) -> None:
        before = self._latest.get(noted.manager)
        if before is not None:
            self._replaced[noted.manager, before] = None
        self._latest[noted.manager] = noted.incarnation
