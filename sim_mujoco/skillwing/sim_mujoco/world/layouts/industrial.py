"""An industrial site: halls, a tank farm, a pipe rack, stacks, containers, and a power line along its northern side.

The route goes round the works. Scale makes the round longer, with more objects beside it.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from skillwing.sim_mujoco.world.footprint import Footprint, Point
from skillwing.sim_mujoco.world.layouts.blockers import (
    CONTAINER_COLOURS,
    block_legs,
    chimney,
    container_stack,
    mast,
)
from skillwing.sim_mujoco.world.layouts.ground import ASPHALT, CONCRETE, PAINT, Ground, Strip
from skillwing.sim_mujoco.world.layouts.plot import Plot
from skillwing.sim_mujoco.world.layouts.surroundings import (
    area_around,
    grow_tree,
    site_around,
)
from skillwing.sim_mujoco.world.site import Area, Site
from skillwing.sim_mujoco.world.terrain import make_terrain
from skillwing.sim_mujoco.world.things.buildings import hall
from skillwing.sim_mujoco.world.things.industry import (
    CONTAINER,
    PYLON_ARM,
    containers,
    pipe_rack,
    pylon,
    stack,
    tank,
    wires,
)
from skillwing.sim_mujoco.world.things.obstacle import Obstacle, ObstacleKind
from skillwing.sim_mujoco.world.things.plain import block
from skillwing.sim_mujoco.world.things.shapes import Colour
from skillwing.sim_mujoco.world.things.street import car, lamp, lorry, van

ALTITUDE = 5.0
ROUND: tuple[float, float] = (66.0, 44.0)
"""East and north extent of the round at scale 1 [m]."""
POWER_LINE = 18.0
"""Distance of the power line to the north of the round [m]."""
WIRE_CLEARANCE = 3.0
"""Free distance between any wire and the area of detours, in plan [m]."""
_MARGIN = POWER_LINE - PYLON_ARM - WIRE_CLEARANCE - 0.2
CEILING = 26.0
PYLON_HEIGHT = 20.0
SPAN = 36.0
SHEETS: tuple[Colour, ...] = ((0.62, 0.66, 0.68), (0.52, 0.58, 0.62), (0.70, 0.66, 0.56), (0.58, 0.50, 0.44))
ROOFS: tuple[Colour, ...] = ((0.45, 0.47, 0.50), (0.38, 0.40, 0.43), (0.55, 0.55, 0.54))
TANKS: tuple[Colour, ...] = ((0.88, 0.88, 0.86), (0.80, 0.82, 0.82), (0.74, 0.78, 0.72))
PIPES: tuple[Colour, ...] = ((0.72, 0.73, 0.74), (0.78, 0.62, 0.22), (0.30, 0.50, 0.36), (0.62, 0.26, 0.20))
PAINTS: tuple[Colour, ...] = ((0.82, 0.82, 0.80), (0.16, 0.30, 0.52), (0.68, 0.42, 0.12), (0.25, 0.26, 0.28))


def industrial_site(seed: int, scale: float) -> Site:
    east, north = ROUND[0] * scale, ROUND[1] * scale
    route = ((east, 0.0, ALTITUDE), (east, north, ALTITUDE), (0.0, north, ALTITUDE), (0.0, 0.0, ALTITUDE))
    area = area_around(route, _MARGIN)
    return site_around("industrial", seed, scale, route=route, area=area, ceiling=CEILING, top=CEILING + 14.0)


def make_industrial(site: Site) -> Ground:
    rng = np.random.default_rng((site.seed, 4))
    borders = area_around(site.way, 0.0)
    west, south, east, north = borders
    centre, half = ((west + east) / 2, (south + north) / 2), ((east - west) / 2 + 60.0, (north - south) / 2 + 55.0)
    terrain = make_terrain(rng, centre, half, 2.0, amplitude=0.15)
    plot = Plot(rng, site)
    block_legs(plot, (mast, chimney, container_stack))
    works = _Works(plot, borders)
    works.build()
    return Ground(terrain, plot.obstacles, works.paving())


class _Works:
    """Builder of the works inside and outside the round, whose borders are `borders`."""

    def __init__(self, plot: Plot, borders: Area) -> None:
        self._plot, self._borders = plot, borders
        self._count = 0

    def build(self) -> None:
        west, south, east, north = self._borders
        self._power_line(north + POWER_LINE)
        self._inside()
        self._outside()
        self._yards()
        self._lamps()
        plot = self._plot
        outer = area_around([(west, south, 0.0), (east, north, 0.0)], 34.0)
        self._wall(area_around([(west, south, 0.0), (east, north, 0.0)], 31.0))
        trees = round((east - west) / 4.0)
        plot.scatter(
            trees,
            lambda _, at: grow_tree(plot, self._named(ObstacleKind.TREE), at),
            (outer[0], outer[3] - 10.0, outer[2], outer[3] + 4.0),
        )

    def paving(self) -> tuple[Strip, ...]:
        west, south, east, north = self._borders
        corners = ((west, south), (east, south), (east, north), (west, north))
        around = [(corners[i], corners[(i + 1) % 4]) for i in range(4)]
        middle = (south + north) / 2
        yard = Strip((west - 29.0, middle), (east + 29.0, middle), north - south + 58.0, CONCRETE)
        grass = Strip(
            (west - 60.0, north + POWER_LINE + 4.0), (east + 60.0, north + POWER_LINE + 4.0), 16.0, (0.42, 0.49, 0.30)
        )
        roads = [Strip(a, b, 7.0, ASPHALT) for a, b in around]
        roads.append(Strip((west - 60.0, south), (west, south), 7.0, ASPHALT))
        lines = [Strip(a, b, 0.18, PAINT) for a, b in around]
        return (yard, grass, *roads, *lines)

    def _named(self, kind: ObstacleKind) -> str:
        self._count += 1
        return f"{kind}-{self._count}"

    def _power_line(self, northing: float) -> None:
        """Pylons in a row, beyond the round on both sides, and the wires between them."""
        west, _, east, _ = self._borders
        spans = math.ceil((east - west + 40.0) / SPAN)
        first = (west + east - spans * SPAN) / 2
        feet = [(first + number * SPAN, northing) for number in range(spans + 1)]
        for foot in feet:
            self._plot.add(pylon(self._named(ObstacleKind.POLE), foot, 0.0, PYLON_HEIGHT))
        for start, end in pairwise(feet):
            self._plot.add(wires(self._named(ObstacleKind.WIRE), start, end, PYLON_HEIGHT), spacing=0.0)

    def _inside(self) -> None:
        """Within the round: a hall, the tank farm, a pipe rack between them, stacks."""
        plot = self._plot
        west, south, east, north = self._borders
        middle = (south + north) / 2 + plot.between(-2.0, 2.0)
        rack = Footprint(((west + east) / 2, middle), ((east - west) / 2 - 9.0, 1.6))
        plot.add(pipe_rack(self._named(ObstacleKind.PIPES), rack, plot.between(6.0, 7.5), PIPES))
        halls_south = plot.chance(0.5)
        for is_south in (True, False):
            low, high = (south + 5.5, middle - 3.5) if is_south else (middle + 3.5, north - 5.5)
            if is_south == halls_south:
                self._halls(low, high)
            else:
                self._tank_farm(low, high)

    def _halls(self, low: float, high: float) -> None:
        plot = self._plot
        west, _, east, _ = self._borders
        x = west + 7.0
        while x < east - 20.0:
            length = min(plot.between(16.0, 28.0), east - 7.0 - x)
            half = length / 2, min((high - low) / 2, plot.between(5.5, 8.5))
            outline = Footprint((x + length / 2, (low + high) / 2), half)
            name, height = self._named(ObstacleKind.BUILDING), plot.between(7.5, 10.5)
            if plot.add(hall(name, outline, height, plot.one_of(SHEETS), plot.one_of(ROOFS))):
                x += length + plot.between(3.0, 5.0)
                self._stack((x + 1.0, high - 2.0))
                x += 5.0
            else:
                x += 3.0

    def _tank_farm(self, low: float, high: float) -> None:
        """Two rows of tanks if there is room, within a retaining wall."""
        plot = self._plot
        west, _, east, _ = self._borders
        rows = max(1, int((high - low) // 13.0))
        pitch = (high - low) / rows
        largest = min(pitch / 2 - 1.4, 6.0)
        x = west + 8.0
        while x + 2 * largest < east - 8.0:
            for row in range(rows):
                radius = plot.between(0.7, 1.0) * largest
                centre = x + largest, low + (row + 0.5) * pitch
                name, height = self._named(ObstacleKind.TANK), plot.between(6.0, 11.0)
                plot.add(tank(name, Footprint(centre, radius=radius), height, plot.one_of(TANKS)))
            x += 2 * largest + plot.between(2.0, 4.0)
        for y in (low, high):
            bund = Footprint(((west + east) / 2, y), ((east - west) / 2 - 7.0, 0.15))
            plot.add(block(self._named(ObstacleKind.WALL), ObstacleKind.WALL, bund, 1.0), spacing=0.2)

    def _stack(self, at: Point) -> None:
        plot = self._plot
        outline = Footprint(at, radius=plot.between(1.0, 1.5))
        plot.add(stack(self._named(ObstacleKind.POLE), outline, plot.between(19.0, CEILING)))

    def _outside(self) -> None:
        """Halls south, east and west of the round."""
        plot = self._plot
        west, south, east, north = self._borders
        x = west - 14.0
        while x < east + 8.0:
            length = plot.between(16.0, 28.0)
            outline = Footprint((x + length / 2, south - 20.0), (length / 2, plot.between(6.0, 8.5)), math.pi)
            name = self._named(ObstacleKind.BUILDING)
            plot.add(hall(name, outline, plot.between(6.0, 10.0), plot.one_of(SHEETS), plot.one_of(ROOFS)))
            x += length + plot.between(3.0, 9.0)
        y = south + 4.0
        while y < north - 10.0:
            length = plot.between(14.0, 22.0)
            outline = Footprint((east + 20.0, y + length / 2), (length / 2, 7.0), math.pi / 2)
            name = self._named(ObstacleKind.BUILDING)
            plot.add(hall(name, outline, plot.between(6.0, 9.0), plot.one_of(SHEETS), plot.one_of(ROOFS)))
            self._stack((east + 11.0, y + length + 2.5))
            y += length + plot.between(6.0, 9.0)
        for number in range(max(2, round((north - south) / 14.0))):
            silo = Footprint((west - 22.0, south + 12.0 + 9.0 * number), radius=3.0)
            plot.add(tank(self._named(ObstacleKind.TANK), silo, plot.between(12.0, 16.0), plot.one_of(TANKS)))

    def _yards(self) -> None:
        """Containers in blocks, lorries and cars."""
        plot = self._plot
        west, south, east, north = self._borders

        def boxes(_: str, at: Point) -> Obstacle:
            yaw = 0.0 if plot.chance(0.7) else math.pi / 2
            outline = Footprint(at, (CONTAINER[0] / 2, CONTAINER[1] / 2), yaw)
            colours = [plot.one_of(CONTAINER_COLOURS) for _ in range(3)]
            return containers(self._named(ObstacleKind.BOX), outline, 1 + int(plot.between(0.0, 2.6)), colours)

        def vehicle(_: str, at: Point) -> Obstacle:
            kind = plot.between(0.0, 1.0)
            make = lorry if kind < 0.4 else van if kind < 0.6 else car
            yaw = math.pi / 2 * int(plot.between(0.0, 4.0)) + plot.between(-0.05, 0.05)
            return make(self._named(ObstacleKind.VEHICLE), at, yaw, plot.one_of(PAINTS))

        count = round((east - west + north - south) / 7.0)
        plot.scatter(count, boxes, (west - 28.0, south - 12.0, west - 5.0, north + 10.0))
        plot.scatter(count // 2, boxes, (west, north + 4.0, east, north + 11.0))
        plot.scatter(count, vehicle, (west - 20.0, south - 13.0, east + 12.0, north + 10.0))

    def _lamps(self) -> None:
        west, south, east, north = self._borders
        for x in np.arange(west + 12.0, east, 24.0).tolist():
            self._plot.add(lamp(self._named(ObstacleKind.POLE), (x, south - 5.2), math.pi / 2, 9.0, 1.6))
            self._plot.add(lamp(self._named(ObstacleKind.POLE), (x, north + 5.2), -math.pi / 2, 9.0, 1.6))

    def _wall(self, around: Area) -> None:
        """The wall of the site, 2.2 m high, with the road through it."""
        west, south, east, north = around
        gate = 6.0
        sides = (
            Footprint(((west + east) / 2, south), ((east - west) / 2, 0.15)),
            Footprint((east, (south + north) / 2), (0.15, (north - south) / 2)),
            Footprint(((west + east) / 2, north), ((east - west) / 2, 0.15)),
            Footprint((west, (south - gate) / 2), (0.15, (-gate - south) / 2)),
            Footprint((west, (north + gate) / 2), (0.15, (north - gate) / 2)),
        )
        for side in sides:
            self._plot.add(block(self._named(ObstacleKind.WALL), ObstacleKind.WALL, side, 2.2), spacing=0.0)
