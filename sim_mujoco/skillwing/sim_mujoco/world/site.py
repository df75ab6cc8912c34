"""The site: all that a mission planner on the ground has of a world before the flight.

It is plain data that can be handed to missions and nodes as options. Frames are ENU with the
origin on the home pad; heights count from the pad [m].
"""

from __future__ import annotations

from dataclasses import dataclass

from skillwing.onboard.frames.extent import Box
from skillwing.onboard.frames.vectors import Vector
from skillwing.sim_mujoco.world.footprint import Point

LARGEST_SEED = 2**32 - 1
"""Largest seed of a world; the least is 0."""
Area = tuple[float, float, float, float]
"""West, south, east and north border [m]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class InspectionTarget:
    """A building to fly around: on the circle with this `radius` around `centre`, at this `height` above the pad."""

    centre: Point
    radius: float
    height: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Site:
    """Route, borders and heights of a site.

    route: waypoints after take-off, the last one over home; its legs begin over home at the first waypoint's height.
    area: borders of detours, inside the `fence`. bounds: all that can be seen from there, for the map. ceiling: height
    of the highest object. return_height: height over everything, which the drone can reach by a climb from any place
    of the route. passage: free ground on both sides of an obstacle on a leg [m].
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
    target: InspectionTarget | None = None
    passage: float = 5.0

    @property
    def way(self) -> tuple[Vector, ...]:
        """The route from its beginning: the place over home where take-off ends, then the waypoints."""
        return (*self.home, self.route[0][2]), *self.route
