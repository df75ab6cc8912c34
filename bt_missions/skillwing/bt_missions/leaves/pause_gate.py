"""What blocks leaves from flying for a while, without taking the tree apart."""

from __future__ import annotations

from typing import Protocol

from skillwing.services.protocol import Terminal

HELD = "HELD"
"""How a leaf ends that was held and does not begin again, in the words of `SkillAction.outcomes`."""


class PauseGate(Protocol):
    """Something above a leaf that may hold it: the safety pilot has the drone, the operator has paused the mission."""

    def blocks(self, skill: str) -> str | None:
        """Why `skill` must not run now; None if it may."""
        ...

    def explains(self, skill: str, terminal: Terminal) -> bool:
        """Whether a goal of `skill` ended like this because of what this hold is about; the news of that may still be
        on its way."""
        ...
