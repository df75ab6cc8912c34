"""A village: houses with gabled roofs along winding lanes, gardens with walls and hedges, trees, a church on its green.

The route follows the lanes round the church. Scale makes the round longer, and puts more houses along it.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from skillwing.sim_mujoco.world.footprint import Footprint, Point
from skillwing.sim_mujoco.world.layouts.blockers import block_legs, lone_tree, mast
from skillwing.sim_mujoco.world.layouts.ground import GRAVEL, Ground, Strip
from skillwing.sim_mujoco.world.layouts.plot import Leg, Plot
from skillwing.sim_mujoco.world.layouts.surroundings import (
    area_around,
    grow_tree,
    site_around,
)
from skillwing.sim_mujoco.world.site import Area, Site
from skillwing.sim_mujoco.world.terrain import make_terrain
from skillwing.sim_mujoco.world.things.buildings import church, house
from skillwing.sim_mujoco.world.things.obstacle import Obstacle, ObstacleKind
from skillwing.sim_mujoco.world.things.plain import block
from skillwing.sim_mujoco.world.things.shapes import Colour
from skillwing.sim_mujoco.world.things.street import car, lamp

ALTITUDE = 5.0
LANES: tuple[Point, ...] = ((40.0, -6.0), (62.0, 20.0), (42.0, 46.0), (8.0, 36.0), (0.0, 0.0))
"""Corners of the round at scale 1, after home [m]."""
GREEN: Point = (33.0, 21.0)
"""Position of the church at scale 1."""
CEILING = 24.0
SETBACK = 4.5
"""Least distance between a lane's middle and a house [m]."""
WALLS: tuple[Colour, ...] = ((0.88, 0.84, 0.75), (0.80, 0.71, 0.58), (0.68, 0.62, 0.55), (0.86, 0.80, 0.68))
ROOFS: tuple[Colour, ...] = ((0.55, 0.27, 0.20), (0.62, 0.35, 0.24), (0.42, 0.30, 0.26), (0.34, 0.33, 0.35))
HEDGE: Colour = (0.20, 0.36, 0.17)
STONES: Colour = (0.60, 0.57, 0.52)
PAINTS: tuple[Colour, ...] = ((0.60, 0.14, 0.12), (0.75, 0.76, 0.78), (0.18, 0.26, 0.42), (0.24, 0.25, 0.26))


def village_site(seed: int, scale: float) -> Site:
    route = tuple((x * scale, y * scale, ALTITUDE) for x, y in LANES)
    area = area_around([(0.0, 0.0, 0.0), *route], 10.0)
    return site_around("village", seed, scale, route=route, area=area, ceiling=CEILING, top=CEILING + 16.0)


def make_village(site: Site) -> Ground:
    rng = np.random.default_rng((site.seed, 3))
    west, south, east, north = area_around(site.way, 0.0)
    centre, half = ((west + east) / 2, (south + north) / 2), ((east - west) / 2 + 60.0, (north - south) / 2 + 60.0)
    terrain = make_terrain(rng, centre, half, 2.0)
    plot = Plot(rng, site)
    block_legs(plot, (mast, lone_tree, lone_tree))
    _Village(plot, (GREEN[0] * site.scale, GREEN[1] * site.scale), area_around(site.way, 26.0)).build()
    return Ground(terrain, plot.obstacles, _lanes(plot.legs, site))


def _lanes(legs: tuple[Leg, ...], site: Site) -> tuple[Strip, ...]:
    """The lanes of the route, a way to the church, and one out of the village at each corner but home's."""
    x, y = GREEN[0] * site.scale, GREEN[1] * site.scale
    (ax, ay), (bx, by) = legs[0]
    outward = [
        Strip((east, north), (x + 2.6 * (east - x), y + 2.6 * (north - y)), 3.6, GRAVEL)
        for (east, north), _ in legs[1::2]
    ]
    to_church = Strip((x, y), ((ax + bx) / 2, (ay + by) / 2), 2.4, GRAVEL)
    return (*outward, to_church, *(Strip(a, b, 4.4, GRAVEL) for a, b in legs))


class _Village:
    def __init__(self, plot: Plot, green: Point, borders: Area) -> None:
        self._plot, self._green, self._borders = plot, green, borders
        self._count = 0

    def build(self) -> None:
        plot = self._plot
        self._church()
        for leg in plot.legs:
            for side in (-1, 1):
                self._houses(leg, side)
        for leg in plot.legs:
            self._lamps(leg)
        self._farms()
        west, south, east, north = self._borders
        acres = (east - west) * (north - south) / 1000.0
        self._scatter(
            round(3.0 * acres), lambda at: grow_tree(plot, self._named(ObstacleKind.TREE), at, radius=(1.2, 2.8))
        )
        self._scatter(round(1.2 * acres), self._shed)

    def _named(self, kind: ObstacleKind) -> str:
        self._count += 1
        return f"{kind}-{self._count}"

    def _scatter(self, count: int, make: Callable[[Point], Obstacle]) -> None:
        self._plot.scatter(count, lambda _, at: make(at), self._borders, tries=8)

    def _church(self) -> None:
        plot = self._plot
        outline = Footprint(self._green, (plot.between(10.0, 12.0), plot.between(4.4, 5.0)), plot.between(-0.5, 0.5))
        plot.add(church(self._named(ObstacleKind.BUILDING), outline, plot.between(20.0, CEILING)))

    def _houses(self, leg: Leg, side: int) -> None:
        """Add houses along one side of a lane, each with a garden."""
        plot = self._plot
        (ax, ay), (bx, by) = leg
        length, yaw = math.dist(*leg), math.atan2(by - ay, bx - ax)
        along = plot.between(6.0, 9.0)
        while along < length - 4.0:
            half = plot.between(4.6, 6.6), plot.between(3.7, 4.8)
            across = plot.chance(0.35)
            depth = half[0] if across else half[1]
            aside = side * (SETBACK + depth + plot.between(0.0, 4.0))
            centre = (
                ax + along * math.cos(yaw) - aside * math.sin(yaw),
                ay + along * math.sin(yaw) + aside * math.cos(yaw),
            )
            facing = yaw + (0.0 if side < 0 else math.pi) + (math.pi / 2 if across else 0.0) + plot.between(-0.12, 0.12)
            if self._house(Footprint(centre, half, facing)):
                self._garden(centre, yaw, side, abs(aside))
                along += plot.between(14.0, 19.0)
            else:
                along += 2.0

    def _house(self, outline: Footprint) -> bool:
        plot = self._plot
        eaves, rise = plot.between(2.9, 5.8), plot.between(0.75, 0.95) * outline.half[1]
        walls, roof = plot.one_of(WALLS), plot.one_of(ROOFS)
        return plot.add(house(self._named(ObstacleKind.BUILDING), outline, eaves, rise, walls, roof), spacing=2.0)

    def _garden(self, house_at: Point, yaw: float, side: int, aside: float) -> None:
        """Add a garden: walls or hedges with an opening towards the lane, a tree, and sometimes a car."""
        plot = self._plot

        def beside(forward: float, outward: float) -> Point:
            """Position near the house: `forward` along the lane, `outward` from its middle [m]."""
            off = side * (outward - aside)
            return (
                house_at[0] + forward * math.cos(yaw) - off * math.sin(yaw),
                house_at[1] + forward * math.sin(yaw) + off * math.cos(yaw),
            )

        is_hedge = plot.chance(0.5)
        height = plot.between(1.2, 1.9) if is_hedge else plot.between(0.9, 1.6)
        thick = 0.4 if is_hedge else 0.18
        for centre in (-4.6, 4.2):
            outline = Footprint(beside(centre, 2.6 + thick), (plot.between(2.4, 3.2), thick), yaw)
            fence = block(
                self._named(ObstacleKind.WALL), ObstacleKind.WALL, outline, height, HEDGE if is_hedge else STONES
            )
            plot.add(fence, spacing=0.3)
        for forward in (-7.6, 7.4):
            outline = Footprint(beside(forward, aside), (thick, plot.between(2.5, 5.0)), yaw)
            fence = block(
                self._named(ObstacleKind.WALL), ObstacleKind.WALL, outline, height, HEDGE if is_hedge else STONES
            )
            plot.add(fence, spacing=0.3)
        behind = beside(plot.between(-6.0, 6.0), aside + plot.between(6.0, 10.0))
        plot.add(grow_tree(plot, self._named(ObstacleKind.TREE), behind))
        if plot.chance(0.45):
            paint = plot.one_of(PAINTS)
            plot.add(
                car(self._named(ObstacleKind.VEHICLE), beside(7.8, 5.6), yaw + side * math.pi / 2, paint), spacing=0.3
            )

    def _lamps(self, leg: Leg) -> None:
        (ax, ay), (bx, by) = leg
        length, yaw = math.dist(*leg), math.atan2(by - ay, bx - ax)
        for along in np.arange(10.0, length, 22.0).tolist():
            foot = ax + along * math.cos(yaw) + 3.9 * math.sin(yaw), ay + along * math.sin(yaw) - 3.9 * math.cos(yaw)
            self._plot.add(lamp(self._named(ObstacleKind.POLE), foot, yaw + math.pi / 2, 5.5, 1.0), spacing=0.3)

    def _farms(self) -> None:
        """Scatter more houses away from the lanes."""
        west, south, east, north = self._borders
        plot = self._plot

        def farm(_: str, at: Point) -> Obstacle:
            outline = Footprint(at, (plot.between(5.0, 8.0), plot.between(3.8, 5.0)), plot.between(0.0, math.pi))
            eaves, rise = plot.between(3.0, 5.5), 0.85 * outline.half[1]
            return house(
                self._named(ObstacleKind.BUILDING), outline, eaves, rise, plot.one_of(WALLS), plot.one_of(ROOFS)
            )

        plot.scatter(round((east - west) * (north - south) / 900.0), farm, self._borders, tries=6)

    def _shed(self, at: Point) -> Obstacle:
        plot = self._plot
        outline = Footprint(at, (plot.between(1.0, 2.2), plot.between(0.9, 1.6)), plot.between(0.0, math.pi))
        return block(self._named(ObstacleKind.BOX), ObstacleKind.BOX, outline, plot.between(1.6, 2.4))
