"""Result of one flight of a campaign."""

from __future__ import annotations

from enum import StrEnum

import msgspec

from skillwing.evaluation.flights.conditions import met_from
from skillwing.evaluation.flights.cost import Cost
from skillwing.evaluation.flights.plan import FlightPlan
from skillwing.services.protocol import MissionPhase


class End(StrEnum):
    """State of the drone at the end of the flight."""

    HOME = "landed at home"
    ELSEWHERE = "landed elsewhere"
    HANDED_OVER = "handed over"
    FLYING = "still flying"
    NOT_LANDED = "not landed"
    """The autopilot says that the drone stands, and it is at rest somewhere else than on the ground."""
    BROKE_OFF = "broke off"


SAFE_ENDS = frozenset({End.HOME, End.ELSEWHERE, End.HANDED_OVER})


class FlightResult(msgspec.Struct, frozen=True, kw_only=True, rename={"cost": "price"}):
    """phase, text: how the mission ended, in its own words. failsafes: what the autopilot did by itself.

    breaches: how often the drone left the fence. clearance: from an obstacle to the blades' tips, the least [m].
    coverage: share of the surface in view of the route that was mapped, None if it was not judged. end_time: robot
    seconds. digest: of the timeline; two flights with the same one are the same flight. processor_time: seconds.
    error: why the flight broke off, empty if it did not. deaths: of processes that it did without, or that were started
    again, in sentences. cost: of energy and of seeing; stored as `price`.
    """

    plan: FlightPlan
    end: End
    phase: str = ""
    text: str = ""
    failsafes: tuple[str, ...] = ()
    collisions: int = 0
    breaches: int = 0
    clearance: float | None = None
    coverage: float | None = None
    end_time: float = 0.0
    digest: str = ""
    processor_time: float = 0.0
    error: str = ""
    deaths: tuple[str, ...] = ()
    cost: Cost = Cost()

    @property
    def met(self) -> bool:
        """True if every planned fault began before the flight was over."""
        begun = met_from(self.plan.circumstances())
        return begun is not None and begun < self.end_time

    @property
    def succeeded(self) -> bool:
        return self.phase == MissionPhase.SUCCEEDED

    @property
    def kept(self) -> bool:
        """The promise: nothing was hit, the fence was kept, and the drone stands or is in the pilot's hands."""
        return not self.broken

    @property
    def broken(self) -> tuple[str, ...]:
        """Broken promises, in words."""
        found: list[str] = []
        if self.collisions:
            found.append(f"{self.collisions} collision{'s' if self.collisions > 1 else ''}")
        if self.breaches:
            found.append("left the fence")
        if self.end not in SAFE_ENDS:
            found.append(f"{self.end}: {self.error}" if self.error else str(self.end))
        return tuple(found)

    @property
    def badness(self) -> tuple[bool, int, bool, float]:
        """Larger for a worse flight: broken promises, then collisions, failure, and a small clearance."""
        clearance = -100.0 if self.clearance is None else -self.clearance
        return not self.kept, self.collisions, not self.succeeded, clearance
