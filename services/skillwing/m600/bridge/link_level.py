"""What the modem says to link status, without chatter at the thresholds."""

from __future__ import annotations

from enum import StrEnum

DEGRADED_BELOW, LOST_BELOW = 0.5, 0.05
"""Of what gets through [Mbit/s]."""
RESERVE = 1.3
"""A better status needs so much more than the threshold."""
SILENCE = 4.0
"""A modem that has not been heard for so long has no link [s]."""


class LinkState(StrEnum):
    """States of the resource `link_status`."""

    GOOD = "GOOD"
    DEGRADED = "DEGRADED"
    LOST = "LOST"


class LinkLevel:
    """Classifies what gets through: worse at once, better only with some reserve. Pure."""

    def __init__(self) -> None:
        self.state: LinkState | None = None

    def update(self, megabits: float) -> LinkState:
        """Take what gets through [Mbit/s] and return the state from now on."""
        lost_reserve = RESERVE if self.state is LinkState.LOST else 1.0
        degraded_reserve = RESERVE if self.state in (LinkState.LOST, LinkState.DEGRADED) else 1.0
        if megabits < LOST_BELOW * lost_reserve:
            self.state = LinkState.LOST
        elif megabits < DEGRADED_BELOW * degraded_reserve:
            self.state = LinkState.DEGRADED
        else:
            self.state = LinkState.GOOD
        return self.state
