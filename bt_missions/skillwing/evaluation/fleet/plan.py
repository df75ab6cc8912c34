"""Plan of one flight of two drones: it determines the whole flight."""

from __future__ import annotations

import random
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import msgspec

from skillwing.evaluation.fleet.yard import GATE, YARD
from skillwing.evaluation.flights.conditions import Condition, draw
from skillwing.evaluation.flights.plan import Place, way_time
from skillwing.services.errors import InvalidOptionError
from skillwing.services.names import MISSION, RESOURCE_MANAGER
from skillwing.sim_mujoco.launching import mapping_mission
from skillwing.sim_mujoco.world.kinds import make_site
from skillwing.sim_mujoco.world.site import Site
from skillwing.sim_mujoco.world.standing import standing_places

ROBOTS = LEFT, RIGHT = "left", "right"
"""Names of the drones. The simulator belongs to the first one."""
WORLD = "courtyard"
EARLIEST_KILL = 5.0
"""Least robot time at which a process is killed [s]."""
VISIT_TIME = 60.0
"""Time that a visit to the pad takes [s], roughly."""
LONGEST_ABSENCE = 30.0
"""Longest time after which a killed judge is started again [s], if it is."""
PATIENCE = 120.0
"""Longest wait of a drone for a place [s]."""


class FleetCondition(StrEnum):
    """Conditions of flights, by their names in the command line."""

    NONE = "none"
    CAMERA = "camera"
    LINK = "link"
    JUDGE = "judge"

    @property
    def summary(self) -> str:
        return _SUMMARIES[self]


_SUMMARIES = {
    FleetCondition.NONE: "nothing goes wrong",
    FleetCondition.CAMERA: "the depth camera of one drone fails, in one of six ways, for a while or for good",
    FleetCondition.LINK: "the link from the ground to one drone fails for good: its mission is gone",
    FleetCondition.JUDGE: "the judge of the shared places is killed; in half of the flights it comes back",
}


@dataclass(frozen=True, slots=True)
class Kill:
    """A process that is killed, at a robot time in s. back_after: time until its next start, None for never."""

    t: float
    robot: str
    process: str
    back_after: float | None = None

    def ends_mission_of(self, drone: str) -> bool:
        """True if the mission of a drone is killed."""
        return (self.robot, self.process) == (drone, MISSION)


class FleetPlan(msgspec.Struct, frozen=True, kw_only=True):
    """Plan of a flight of two drones in a courtyard. Each maps one half, and then visits the pad that they share.

    The way to the pad is a corridor, which they share as well.
    """

    seed: int
    condition: FleetCondition = FleetCondition.NONE

    @property
    def name(self) -> str:
        """Name of the flight, unique and valid as a file name."""
        return f"fleet-{self.condition}-{self.seed}"

    @property
    def hit(self) -> str:
        """The robot whose camera or link fails."""
        return ROBOTS[self._chance().randrange(len(ROBOTS))]

    def site(self) -> Site:
        return make_site(self.seed, WORLD)

    def routes(self) -> dict[str, tuple[Place, ...]]:
        """Waypoints of each robot in its half, without take-off and return."""
        return halves(self.site())

    def robot_options(self, robot: str) -> dict[str, Any]:
        """Options of a robot's functional layer."""
        options: dict[str, Any] = {"seed": self.seed, "world": WORLD}
        if robot != LEFT:
            return options | {"world_of": LEFT}
        own: dict[str, Any] = {each: {} for each in ROBOTS}
        if self.condition is FleetCondition.CAMERA:
            own[self.hit] = draw(Condition.CAMERA, self.seed, way_time(self.way(self.hit)))
        return options | {"robots": own}

    def mission_options(self, robot: str) -> dict[str, Any]:
        """Options of a robot's mission: its half, and the area of detours of the whole site."""
        route, (x, y) = self.routes()[robot], self.homes()[robot]
        return {
            "holder": robot,
            "mapping": {**mapping_mission(self.site()), "route": route},
            "home": (x, y, route[0][2]),
            "gate": GATE,
            "patience": PATIENCE,
        }

    def kill(self) -> Kill | None:
        """The process that is killed in this flight."""
        chance = self._chance()
        chance.random()
        longest = 2.0 * max(way_time(self.way(robot)) for robot in ROBOTS) + 2.0 * VISIT_TIME
        t = round(chance.uniform(EARLIEST_KILL, longest), 2)
        match self.condition:
            case FleetCondition.LINK:
                return Kill(t, self.hit, MISSION)
            case FleetCondition.JUDGE:
                returns = chance.random() < 0.5
                back_after = round(chance.uniform(1.0, LONGEST_ABSENCE), 2) if returns else None
                return Kill(t, YARD, RESOURCE_MANAGER, back_after)
            case FleetCondition.NONE | FleetCondition.CAMERA:
                return None

    def way(self, robot: str) -> tuple[Place, ...]:
        """Planned way of a robot, from over its home to over its home."""
        (x, y), route = self.homes()[robot], self.routes()[robot]
        over_home = x, y, route[0][2]
        return over_home, *route, over_home

    def homes(self) -> dict[str, tuple[float, float]]:
        """Place of each drone at the start."""
        return dict(zip(ROBOTS, standing_places(self.site(), len(ROBOTS)), strict=True))

    def _chance(self) -> random.Random:
        return random.Random(f"fleet {self.condition} {self.seed}")


def halves(site: Site) -> dict[str, tuple[Place, ...]]:
    """Waypoints of each robot in a courtyard: the left one maps its north-west, the right one its south-east.

    The ways lie on the legs of the site's route, where obstacles leave room. They are 9 m apart, except within 8 m of
    the pad, and pass at 4 m from the pad. From its last waypoint each robot flies home over everything, at 0.8 m
    from pad and corridor or more.

    Raises InvalidOptionError for another kind of world.
    """
    if site.kind != WORLD:
        raise InvalidOptionError("world", f"Two drones divide a courtyard, not a {site.kind}. Choose a courtyard.")
    (east, south, height), (_, north, _), (west, _, _), _ = site.route
    middle = (south + north) / 2.0
    left = (1.0, 4.5, height), (west, north, height), (west + 10.0, north, height)
    right = (7.0, south - 4.0, height), (east, south, height), (east, middle - 5.0, height)
    return {LEFT: left, RIGHT: right}
