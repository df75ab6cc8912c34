"""Promises that every world keeps, whatever its seed, so that flights are comparable. They are checked in plan."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from skillwing.onboard.frames.extent import Box
from skillwing.sim_mujoco.world.footprint import Footprint
from skillwing.sim_mujoco.world.layouts.industrial import WIRE_CLEARANCE
from skillwing.sim_mujoco.world.layouts.inspection import FREE
from skillwing.sim_mujoco.world.layouts.plot import LEG_CLEARANCE, PAD_CLEARANCE, distance_to_legs, legs_of, passage
from skillwing.sim_mujoco.world.layouts.surroundings import OVER_ALL
from skillwing.sim_mujoco.world.site import Area, Site
from skillwing.sim_mujoco.world.things.obstacle import Obstacle, ObstacleKind

HIGHER_THAN_THE_ROUTE = 1.5
"""Least height of an obstacle on a leg above the route [m]."""
WIDEST = 6.1
"""Largest extent of an obstacle on a leg [m]."""
_ROUNDING = 1e-6


def broken_promises(site: Site, obstacles: Sequence[Obstacle]) -> list[str]:
    """A sentence for each promise that does not hold; none for every world there is."""
    return [
        *_of_the_site(site),
        *_of_the_legs(site, obstacles),
        *_of_heights(site, obstacles),
        *_of_air(site, obstacles),
    ]


def _of_the_site(site: Site) -> Iterator[str]:
    west, south, east, north = site.area
    for x, y, z in site.way:
        if not (west + 1.0 <= x <= east - 1.0 and south + 1.0 <= y <= north - 1.0):
            yield f"the waypoint ({x:g}, {y:g}, {z:g}) is less than 1 m inside the area of detours"
    if site.way[-1] != site.way[0]:
        yield "the route does not end where it began"
    if not _holds(site.fence, site.area, site.return_height):
        yield "the fence does not hold the area of detours up to the height of return"
    if any(a > b for a, b in zip(site.bounds.low[:2], site.fence.low[:2], strict=True)) or any(
        a < b for a, b in zip(site.bounds.high[:2], site.fence.high[:2], strict=True)
    ):
        yield "the bounds of the map do not hold the fence"


def _of_the_legs(site: Site, obstacles: Sequence[Obstacle]) -> Iterator[str]:
    legs, altitude = legs_of(site.way), site.way[0][2]
    blockers = [each for each in obstacles if each.leg is not None]
    if not blockers and site.target is None:
        yield "nothing stands on the route"
    for each in obstacles:
        if each.footprint.distance_to(site.home) < PAD_CLEARANCE:
            yield f"{each.name} is too close to the pad"
        if each.leg is None and distance_to_legs(each.footprint, legs) < LEG_CLEARANCE:
            yield f"{each.name} is too close to a leg"
    for each in blockers:
        assert each.leg is not None
        if each.footprint.distance_to_segment(*legs[each.leg]) > 0.0:
            yield f"{each.name} stands beside its leg"
        if each.height < altitude + HIGHER_THAN_THE_ROUTE:
            yield f"{each.name} is hardly higher than the route"
        if 2 * (max(each.footprint.half) + each.footprint.radius) > WIDEST:
            yield f"{each.name} is too wide"
        way_round = passage(each, legs, site.passage)
        for other in obstacles:
            if other is not each and way_round.distance_to_footprint(other.footprint) == 0.0:
                yield f"{other.name} stands in the way round {each.name}"


def _of_heights(site: Site, obstacles: Iterable[Obstacle]) -> Iterator[str]:
    for each in obstacles:
        if each.height > site.ceiling + _ROUNDING:
            yield f"{each.name} is higher than the ceiling"
    if site.return_height < site.ceiling + OVER_ALL:
        yield "the height of return is not over everything"


def _of_air(site: Site, obstacles: Sequence[Obstacle]) -> Iterator[str]:
    west, south, east, north = site.area
    area = Footprint(((west + east) / 2, (south + north) / 2), ((east - west) / 2, (north - south) / 2))
    for each in obstacles:
        if each.kind is ObstacleKind.WIRE and area.distance_to_footprint(each.footprint) < WIRE_CLEARANCE:
            yield f"{each.name} hangs too close to the area of detours"
    if site.target is None:
        return
    target, *others = obstacles
    if target.footprint.distance_to(site.target.centre) > 0.0:
        yield "the target of the inspection does not stand in the middle of its circle"
    for each in others:
        if each.footprint.distance_to(site.target.centre) < site.target.radius + FREE - _ROUNDING:
            yield f"{each.name} stands too close to the circle of the inspection"


def _holds(fence: Box, area: Area, height: float) -> bool:
    """The fence holds the area up to this height, with at least 1 m to spare."""
    west, south, east, north = area
    return fence.contains((west, south, height), -1.0) and fence.contains((east, north, height), -1.0)
