"""Result of one flight of two drones."""

from __future__ import annotations

import msgspec

from skillwing.evaluation.fleet.plan import FleetCondition, FleetPlan
from skillwing.evaluation.flights.result import SAFE_ENDS, End
from skillwing.services.protocol import MissionPhase


class RobotResult(msgspec.Struct, frozen=True, kw_only=True):
    """The part of one robot. Fields as in `FlightResult`; `map_voxels`: occupied voxels of its map."""

    end: End
    phase: str = ""
    text: str = ""
    failsafes: tuple[str, ...] = ()
    collisions: int = 0
    breaches: int = 0
    clearance: float | None = None
    digest: str = ""
    map_voxels: int = 0

    @property
    def broken(self) -> tuple[str, ...]:
        """Broken promises, in words."""
        found = [f"{self.collisions} collisions"] if self.collisions else []
        found += ["left the fence"] if self.breaches else []
        return (*found, *([str(self.end)] if self.end not in SAFE_ENDS else []))


class FleetResult(msgspec.Struct, frozen=True, kw_only=True):
    """robots: results by robot. separation: least distance between the drones, tip to tip [m]. coverage: share of the
    surface in view of both ways that either map has; None if it was not judged. met: moments at which both drones were
    in one place, at any height. history: what does not fit in the histories of the places; empty if they are
    linearizable or were not judged. visits: landings on the pad, by robot. held_at_kill: a drone held the pad when a
    process was killed; None if none was. end_time: when both had come to their end [robot s].
    processor_time: seconds. error: why the flight broke off, empty if it did not."""

    plan: FleetPlan
    robots: dict[str, RobotResult]
    separation: float | None = None
    coverage: float | None = None
    met: int = 0
    history: str = ""
    visits: dict[str, int] = {}
    held_at_kill: bool | None = None
    end_time: float = 0.0
    processor_time: float = 0.0
    error: str = ""

    @property
    def kept(self) -> bool:
        """The promise: nothing was hit, the fence was kept, both drones stand, never were both in one place, and nobody
        waits for ever. If nothing goes wrong, both visit the pad as well."""
        safe = not self.met and not self.history and not any(each.broken for each in self.robots.values())
        return safe and not self.unfinished and (self.plan.condition is not FleetCondition.NONE or self.visited)

    @property
    def unfinished(self) -> tuple[str, ...]:
        """The robots whose mission was not killed and has not ended."""
        kill = self.plan.kill()
        open_ended = (
            robot for robot, each in self.robots.items() if not each.phase or not MissionPhase(each.phase).over
        )
        return tuple(robot for robot in open_ended if kill is None or not kill.ends_mission_of(robot))

    @property
    def visited(self) -> bool:
        """True if both missions have succeeded, each with a landing on the pad."""
        return self.succeeded == len(self.robots) and all(self.visits.get(robot) for robot in self.robots)

    @property
    def succeeded(self) -> int:
        """Number of missions that succeeded."""
        return sum(each.phase == MissionPhase.SUCCEEDED for each in self.robots.values())
