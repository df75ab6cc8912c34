"""States of the extern resources, as levels that the bridge keeps asserting, and their thresholds with hysteresis."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

LOW_BELOW, CRITICAL_BELOW = 30.0, 15.0
HYSTERESIS = 3.0
"""Reserve above the threshold for a better battery status [%]."""
DEGRADED_BELOW, LOST_BELOW = 0.5, 0.05
"""Bandwidth that arrives [Mbit/s]."""
RESERVE = 1.3
"""Factor on the threshold for a better link status."""
SILENCE = 4.0
"""Time without a message of the modem after which the link is LOST [s]."""


class BatteryStatus(StrEnum):
    """States of the resource `battery_status`."""

    NORMAL = "NORMAL"
    LOW = "LOW"
    CRITICAL = "CRITICAL"


class BatteryLevel:
    """Classifier of percentages with hysteresis: worse at once, better only with a reserve. Pure."""

    def __init__(self) -> None:
        self.status: BatteryStatus | None = None

    def update(self, percent: float) -> BatteryStatus:
        """Take a percentage (0 to 100) and return the new status."""
        margin_critical = HYSTERESIS if self.status is BatteryStatus.CRITICAL else 0.0
        margin_low = HYSTERESIS if self.status in (BatteryStatus.CRITICAL, BatteryStatus.LOW) else 0.0
        if percent < CRITICAL_BELOW + margin_critical:
            self.status = BatteryStatus.CRITICAL
        elif percent < LOW_BELOW + margin_low:
            self.status = BatteryStatus.LOW
        else:
            self.status = BatteryStatus.NORMAL
        return self.status


class LinkState(StrEnum):
    """States of the resource `link_status`."""

    GOOD = "GOOD"
    DEGRADED = "DEGRADED"
    LOST = "LOST"


class LinkLevel:
    """Classifier of the bandwidth that arrives, with hysteresis: worse at once, better only with a reserve. Pure."""

    def __init__(self) -> None:
        self.state: LinkState | None = None

    def update(self, megabits: float) -> LinkState:
        """Take the bandwidth that arrives [Mbit/s] and return the new state."""
        lost_reserve = RESERVE if self.state is LinkState.LOST else 1.0
        degraded_reserve = RESERVE if self.state in (LinkState.LOST, LinkState.DEGRADED) else 1.0
        if megabits < LOST_BELOW * lost_reserve:
            self.state = LinkState.LOST
        elif megabits < DEGRADED_BELOW * degraded_reserve:
            self.state = LinkState.DEGRADED
        else:
            self.state = LinkState.GOOD
        return self.state


@dataclass(frozen=True, slots=True)
class Level:
    """Required state of a resource; `cause` is the timeline record of the reason."""

    resource: str
    state: str
    cause: str | None


class ExternLevels:
    """States that the functional layer requires of the extern resources. Pure.

    The bridge compares levels, not edges: it asks again until each resource is in its state. So a lost request, a
    restart of either side or any order of start needs no special case.
    """

    def __init__(self) -> None:
        self._levels: dict[str, Level] = {}

    def wanted(self, resource: str) -> str | None:
        """The state that the resource should have, None while it is unknown."""
        level = self._levels.get(resource)
        return None if level is None else level.state

    def want(self, resource: str, state: str, cause: str | None) -> None:
        """Require `state` of the resource; `cause` is the record of the reason."""
        self._levels[resource] = Level(resource, state, cause)

    def mismatches(self, states: Mapping[str, str]) -> list[Level]:
        """Levels of the resources whose current state, among the known `states`, is another one."""
        return [
            level
            for level in self._levels.values()
            if level.resource in states and states[level.resource] != level.state
        ]
