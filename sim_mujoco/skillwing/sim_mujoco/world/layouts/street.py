"""An avenue between two rows of houses: trees and lamps along it, parked vehicles, a green strip in its middle.

The route leads down one carriageway and back up the other. Scale makes it longer.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from skillwing.onboard.frames.vectors import Vector
from skillwing.sim_mujoco.world.footprint import Footprint, Point
from skillwing.sim_mujoco.world.layouts.blockers import block_legs, board, lone_tree, mast
from skillwing.sim_mujoco.world.layouts.ground import ASPHALT, FOOTWAY, PAINT, Ground, Strip
from skillwing.sim_mujoco.world.layouts.plot import Plot
from skillwing.sim_mujoco.world.layouts.surroundings import (
    LEAVES,
    area_around,
    grow_tree,
    site_around,
)
from skillwing.sim_mujoco.world.site import Site
from skillwing.sim_mujoco.world.terrain import make_terrain
from skillwing.sim_mujoco.world.things.buildings import flat_house, hall, house
from skillwing.sim_mujoco.world.things.obstacle import Obstacle, ObstacleKind
from skillwing.sim_mujoco.world.things.plain import block, tree
from skillwing.sim_mujoco.world.things.shapes import Colour
from skillwing.sim_mujoco.world.things.street import CAR, LORRY, VAN, car, lamp, lorry, van

ALTITUDE = 5.0
LENGTH = 60.0
MIDDLE = 4.0
"""Northing of the middle of the avenue, which runs west to east; carriageways lie 4 m to both sides [m]."""
CARRIAGEWAY, KERB, TREES, FRONT = 4.0, 8.4, 11.2, 14.0
"""Distance from the middle: centre of a carriageway, of the parked cars, of the trees, the fronts of the houses [m]."""
DEPTH = 10.0
CEILING = 14.0
WALLS: tuple[Colour, ...] = (
    (0.84, 0.78, 0.66),
    (0.78, 0.62, 0.50),
    (0.70, 0.72, 0.70),
    (0.80, 0.72, 0.56),
    (0.64, 0.42, 0.34),
    (0.75, 0.79, 0.80),
)
ROOFS: tuple[Colour, ...] = ((0.52, 0.26, 0.20), (0.58, 0.33, 0.24), (0.36, 0.34, 0.36), (0.45, 0.24, 0.20))
PAINTS: tuple[Colour, ...] = (
    (0.72, 0.12, 0.12),
    (0.14, 0.26, 0.52),
    (0.85, 0.85, 0.86),
    (0.20, 0.21, 0.23),
    (0.55, 0.57, 0.58),
    (0.20, 0.40, 0.30),
)


def street_site(seed: int, scale: float) -> Site:
    far, near, far_side = LENGTH * scale, MIDDLE - CARRIAGEWAY, MIDDLE + CARRIAGEWAY
    route = ((far, near, ALTITUDE), (far, far_side, ALTITUDE), (0.0, far_side, ALTITUDE), (0.0, 0.0, ALTITUDE))
    area = (-8.0, MIDDLE - FRONT + 1.0, far + 8.0, MIDDLE + FRONT - 1.0)
    return site_around("street", seed, scale, route=route, area=area, ceiling=CEILING, top=30.0)


def make_street(site: Site) -> Ground:
    rng = np.random.default_rng((site.seed, 2))
    west, _, east, _ = area_around(site.way, 0.0)
    terrain = make_terrain(rng, ((west + east) / 2, MIDDLE), ((east - west) / 2 + 50.0, 55.0), 2.0, amplitude=0.15)
    plot = Plot(rng, site)
    block_legs(plot, (mast, board, lone_tree))
    street = _Street(plot, west, east)
    street.build()
    return Ground(terrain, plot.obstacles, street.paving())


class _Street:
    """Builder of the street between the ends of the route, west and east; it reaches beyond on both sides."""

    def __init__(self, plot: Plot, west: float, east: float) -> None:
        self._plot = plot
        self._west, self._east = west - 20.0, east + 16.0
        self._count = 0

    def build(self) -> None:
        for side in (-1, 1):
            self._row(side)
            self._lamps(side)
            self._trees(side)
            self._parked(side)
            self._gardens(side)
        self._green_strip()
        self._end_of_the_street()

    def paving(self) -> tuple[Strip, ...]:
        def lengthwise(northing: float, width: float, colour: Colour) -> Strip:
            return Strip((self._west - 20.0, northing), (self._east + 4.0, northing), width, colour)

        green = (0.40, 0.50, 0.28)
        marks = [
            Strip((x, MIDDLE + side * CARRIAGEWAY), (x + 2.0, MIDDLE + side * CARRIAGEWAY), 0.15, PAINT)
            for x in np.arange(self._west - 18.0, self._east, 6.0).tolist()
            for side in (-1, 1)
        ]
        return (
            lengthwise(MIDDLE, 2 * FRONT, FOOTWAY),
            lengthwise(MIDDLE, 2 * KERB + 2.2, ASPHALT),
            lengthwise(MIDDLE, 2.4, green),
            *marks,
        )

    def _named(self, kind: ObstacleKind) -> str:
        self._count += 1
        return f"{kind}-{self._count}"

    def _row(self, side: int) -> None:
        """Houses wall to wall; now and then an alley."""
        plot, x = self._plot, self._west
        facing = 0.0 if side < 0 else math.pi
        while x < self._east - 7.0:
            width = min(plot.between(7.0, 12.0), self._east - x)
            outline = Footprint((x + width / 2, MIDDLE + side * (FRONT + DEPTH / 2)), (width / 2, DEPTH / 2), facing)
            name, walls = self._named(ObstacleKind.BUILDING), plot.one_of(WALLS)
            if plot.chance(0.2):
                plot.add(flat_house(name, outline, plot.between(9.0, 12.5), walls, terraced=True), spacing=0.0)
            else:
                eaves, rise = plot.between(6.2, 9.2), plot.between(2.4, 3.6)
                plot.add(house(name, outline, eaves, rise, walls, plot.one_of(ROOFS), terraced=True), spacing=0.0)
            x += width + (plot.between(4.0, 6.0) if plot.chance(0.15) else 0.0)

    def _lamps(self, side: int) -> None:
        for x in np.arange(self._west + 5.0, self._east, 20.0).tolist():
            foot = (x + (10.0 if side > 0 else 0.0), MIDDLE + side * (KERB + 1.5))
            name, towards = self._named(ObstacleKind.POLE), -side * math.pi / 2
            self._plot.add(lamp(name, foot, towards, 7.0, 1.8))

    def _trees(self, side: int) -> None:
        plot = self._plot
        for x in np.arange(self._west, self._east, 9.0).tolist():
            at = x + plot.between(-1.0, 1.0), MIDDLE + side * (TREES + plot.between(-0.2, 0.2))
            outline = Footprint(at, radius=plot.between(1.1, 1.6))
            leaves = plot.one_of(LEAVES)
            plot.add(tree(self._named(ObstacleKind.TREE), outline, plot.between(5.0, 7.0), leaves), spacing=0.4)

    def _parked(self, side: int) -> None:
        """Cars bumper to bumper, some places empty."""
        plot, x = self._plot, self._west
        heading = math.pi if side > 0 else 0.0
        while x < self._east:
            make, (length, width, _) = self._vehicle()
            centre = (x + length / 2, MIDDLE + side * (KERB + 1.1 - width / 2))
            if plot.chance(0.65):
                yaw = heading + plot.between(-0.02, 0.02)
                plot.add(make(self._named(ObstacleKind.VEHICLE), centre, yaw, plot.one_of(PAINTS)), spacing=0.3)
            x += length + plot.between(0.8, 1.6)

    def _vehicle(self) -> tuple[Callable[[str, Point, float, Colour], Obstacle], Vector]:
        kind = self._plot.between(0.0, 1.0)
        return (lorry, LORRY) if kind < 0.06 else (van, VAN) if kind < 0.2 else (car, CAR)

    def _green_strip(self) -> None:
        plot = self._plot
        for x in np.arange(self._west, self._east, 7.5).tolist():
            outline = Footprint((x + plot.between(-0.8, 0.8), MIDDLE), radius=plot.between(0.9, 1.4))
            plot.add(tree(self._named(ObstacleKind.TREE), outline, plot.between(4.5, 6.5), plot.one_of(LEAVES)))

    def _gardens(self, side: int) -> None:
        back = MIDDLE + side * (FRONT + DEPTH)
        low, high = sorted((back + side * 2.0, back + side * 18.0))
        count = round((self._east - self._west) / 6.0)
        self._plot.scatter(
            count,
            lambda _, at: grow_tree(self._plot, self._named(ObstacleKind.TREE), at),
            (self._west, low, self._east, high),
        )

        def shed(_: str, at: Point) -> Obstacle:
            outline = Footprint(at, (self._plot.between(1.0, 2.0), self._plot.between(1.0, 1.5)))
            return block(self._named(ObstacleKind.BOX), ObstacleKind.BOX, outline, self._plot.between(2.0, 2.6))

        self._plot.scatter(count // 3, shed, (self._west, low, self._east, high))

    def _end_of_the_street(self) -> None:
        """A large house across, and trees beyond the other end."""
        outline = Footprint((self._east + 12.0, MIDDLE), (FRONT + 6.0, 6.0), math.pi / 2)
        self._plot.add(
            hall(self._named(ObstacleKind.BUILDING), outline, 9.0, (0.72, 0.66, 0.56), self._plot.one_of(ROOFS))
        )
        edge = self._west - 3.0
        self._plot.scatter(
            10,
            lambda _, at: grow_tree(self._plot, self._named(ObstacleKind.TREE), at),
            (edge - 18.0, MIDDLE - 22.0, edge, MIDDLE + 22.0),
        )
