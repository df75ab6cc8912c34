"""Processes of one name, one after the other: whichever came last is the one that counts."""

from __future__ import annotations

from skillwing.services.core.memory import Recent
from skillwing.services.core.refusal import RefusedError
from skillwing.services.protocol import ErrorCode

INCARNATIONS_REMEMBERED = 1000


class Incarnations:
    """The latest incarnation of each manager, and those that it has replaced."""

    def __init__(self) -> None:
        self._latest: Recent[str, str] = Recent(INCARNATIONS_REMEMBERED)
        self._replaced: Recent[tuple[str, str], None] = Recent(INCARNATIONS_REMEMBERED)

    def check(self, manager: str, incarnation: str) -> None:
        """Refuse one that has been replaced: its messages were under way for long, or it hung and woke up."""
        if (manager, incarnation) in self._replaced:
            text = f"Another process has taken the place of this `{manager}`."
            raise RefusedError(ErrorCode.STALE_TOKEN, text, help="End this process.")

    def note(self, manager: str, incarnation: str) -> None:
        """Take it for the latest."""
        before = self._latest.get(manager)
        if before is not None and before != incarnation:
            self._replaced[manager, before] = None
        self._latest[manager] = incarnation
