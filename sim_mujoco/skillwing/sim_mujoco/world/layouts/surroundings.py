"""Borders that follow from a route, and trees for any layout."""

from __future__ import annotations

from collections.abc import Sequence

from skillwing.onboard.frames.extent import Box
from skillwing.onboard.frames.vectors import Vector
from skillwing.sim_mujoco.world.footprint import Footprint, Point
from skillwing.sim_mujoco.world.layouts.plot import Plot
from skillwing.sim_mujoco.world.site import Area, InspectionTarget, Site
from skillwing.sim_mujoco.world.things.obstacle import Obstacle
from skillwing.sim_mujoco.world.things.plain import tree
from skillwing.sim_mujoco.world.things.shapes import Colour
from skillwing.sim_mujoco.world.things.street import broad_tree, conifer

FENCE_MARGIN = 5.0
"""Distance of the geofence from the area of detours [m]."""
SIGHT = 30.0
"""Distance from the geofence up to which objects are mapped [m]."""
OVER_ALL = 3.0
"""Least height of the flight home above the ceiling [m]."""
LEAVES: tuple[Colour, ...] = ((0.27, 0.44, 0.20), (0.34, 0.48, 0.20), (0.22, 0.38, 0.19), (0.42, 0.47, 0.20))
NEEDLES: tuple[Colour, ...] = ((0.15, 0.31, 0.20), (0.19, 0.34, 0.19))


def area_around(places: Sequence[Vector], margin: float) -> Area:
    """The rectangle around places, and so much more on each side [m]."""
    xs, ys = [x for x, _, _ in places], [y for _, y, _ in places]
    return min(xs) - margin, min(ys) - margin, max(xs) + margin, max(ys) + margin


def site_around(
    kind: str,
    seed: int,
    scale: float,
    *,
    route: Sequence[Vector],
    area: Area,
    ceiling: float,
    top: float,
    target: InspectionTarget | None = None,
) -> Site:
    """The site whose borders follow from its area of detours. top: of the geofence, above the pad [m]."""
    west, south, east, north = area
    edge, far = FENCE_MARGIN, FENCE_MARGIN + SIGHT
    return Site(
        kind=kind,
        seed=seed,
        scale=scale,
        route=tuple(route),
        area=area,
        fence=Box((west - edge, south - edge, -1.0), (east + edge, north + edge, top)),
        bounds=Box((west - far, south - far, -4.0), (east + far, north + far, ceiling + 4.0)),
        ceiling=ceiling,
        return_height=ceiling + OVER_ALL,
        target=target,
    )


def grow_tree(plot: Plot, name: str, at: Point, *, radius: tuple[float, float] = (1.2, 2.4)) -> Obstacle:
    """A tree of any of three kinds; the wider, the higher. None is higher than 11 m."""
    crown = plot.between(*radius)
    outline, height = Footprint(at, radius=crown), plot.between(2.6, 3.4) * crown + 2.5
    kind = plot.between(0.0, 1.0)
    if kind < 0.25:
        return conifer(name, outline, height, plot.one_of(NEEDLES))
    if kind < 0.7:
        return broad_tree(name, outline, height, plot.one_of(LEAVES))
    return tree(name, outline, height, plot.one_of(LEAVES))
