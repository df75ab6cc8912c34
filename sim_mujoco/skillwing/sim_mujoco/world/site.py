"""What a mission planner on the ground knows of a site before the flight, and nothing more.

Everything here is plain data, so that it can be handed to missions and nodes as options. Frames are ENU with the
origin on the home pad; heights count from the pad [m].
"""

from __future__ import annotations

from dataclasses import dataclass

from skillwing.onboard.frames.vectors import Vector
from skillwing.onboard.geofence import Box
from skillwing.sim_mujoco.world.footprint import Point

LARGEST_SEED = 2**32 - 1
"""The least is 0."""
Area = tuple[float, float, float, float]
"""West, south, east and north border [m]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Target:
    """A building to fly around: on the circle with this `radius` around `centre`, at this `height` above the pad."""

    centre: Point
    radius: float
    height: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Site:
    """Where one may fly, where to, and how high everything can be flown over.

    route: waypoints after take-off, the last one over home; its legs begin over home at the first waypoint's height.
    area: where detours may lead, inside the `fence`. bounds: what can be seen from there, hence what a map has to
    hold. ceiling: nothing on the site is higher. return_height: from any place of the route the drone can climb
    straight up to it, and then fly home over everything. passage: what stands on a leg leaves so much free ground on
    both sides [m].
    """

    kind: str
    seed: int
    scale: float
    route: tuple[Vector, ...]
    area: Area
    fence: Box
    bounds: Box
    ceiling: float
    return_height: float
    home: Point = (0.0, 0.0)
    target: Target | None = None
    passage: float = 5.0

    @property
    def way(self) -> tuple[Vector, ...]:
        """The route from its beginning: the place over home where take-off ends, then the waypoints."""
        return (*self.home, self.route[0][2]), *self.route
