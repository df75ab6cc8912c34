"""A tall building in free surroundings, to be flown around: the scenario of the paper's Section 2.1.

Nothing else stands within 6 m of the circle of the inspection, at any height. Scale makes the building larger.
"""

from __future__ import annotations

import math

import numpy as np

from skillwing.sim_mujoco.world.footprint import Footprint, Point
from skillwing.sim_mujoco.world.layouts.ground import ASPHALT, FOOTWAY, Ground, Strip
from skillwing.sim_mujoco.world.layouts.plot import Plot
from skillwing.sim_mujoco.world.layouts.street import PAINTS
from skillwing.sim_mujoco.world.layouts.surroundings import (
    OVER_ALL,
    area_around,
    grow_tree,
    site_around,
)
from skillwing.sim_mujoco.world.site import InspectionTarget, Site
from skillwing.sim_mujoco.world.terrain import make_terrain
from skillwing.sim_mujoco.world.things.buildings import reach_of, tower_block
from skillwing.sim_mujoco.world.things.obstacle import Obstacle, ObstacleKind
from skillwing.sim_mujoco.world.things.plain import block
from skillwing.sim_mujoco.world.things.shapes import Colour
from skillwing.sim_mujoco.world.things.street import car, lamp

STANDOFF = 7.0
"""Distance between the circle of the inspection and the building's corners [m]."""
FREE = 6.0
"""Least distance between the circle and anything else [m]."""
HIGHEST, MAST = 24.0, 3.5
"""Heights of the building at scale 1, and of the mast on its roof [m]."""
WALLS: tuple[Colour, ...] = ((0.80, 0.76, 0.68), (0.70, 0.56, 0.46), (0.76, 0.78, 0.80))
BUSH: Colour = (0.26, 0.40, 0.20)


def inspection_site(seed: int, scale: float) -> Site:
    """The site with the building, whose measures follow from the seed."""
    outline, height = _measures(seed, scale)
    radius = reach_of(outline) + STANDOFF
    (x, y), level = outline.centre, round(0.55 * height, 1)
    route = (
        (x - radius, y - radius, level),
        (x + radius, y - radius, level),
        (x + radius, y + radius, level),
        (x - radius, y + radius, level),
        (0.0, 0.0, level),
    )
    ceiling = HIGHEST * scale + MAST
    area = area_around([(0.0, 0.0, 0.0), *route], FREE)
    return site_around(
        "inspection",
        seed,
        scale,
        route=route,
        area=area,
        ceiling=ceiling,
        top=ceiling + 2 * OVER_ALL,
        target=InspectionTarget(centre=outline.centre, radius=radius, height=level),
    )


def make_inspection(site: Site) -> Ground:
    assert site.target is not None
    rng = np.random.default_rng((site.seed, 6))
    (x, y), ring = site.target.centre, site.target.radius + FREE
    terrain = make_terrain(rng, (x, y), (x + 60.0, x + 60.0), 2.0)
    plot = Plot(rng, site, keep_free=[Footprint((x, y), radius=ring)])
    outline, height = _measures(site.seed, site.scale)
    target = tower_block("building-target", outline, height, MAST, plot.one_of(WALLS))
    surroundings = _Surroundings(plot, (x, y), ring)
    surroundings.build()
    return Ground(terrain, (target, *plot.obstacles), surroundings.paving(outline))


def _measures(seed: int, scale: float) -> tuple[Footprint, float]:
    """Outline and height of the building. Its circle begins 8 m east of the home pad."""
    rng = np.random.default_rng((seed, 5))
    half = scale * float(rng.uniform(9.0, 12.0)), scale * float(rng.uniform(7.0, 8.5))
    height = 3.0 * round(scale * float(rng.uniform(18.0, HIGHEST - 0.1)) / 3.0)
    yaw = float(rng.uniform(-0.4, 0.4))
    east = math.hypot(*half) + STANDOFF + 8.0
    return Footprint((round(east, 1), 0.0), half, yaw), min(height, HIGHEST * scale)


class _Surroundings:
    """A meadow with a car park, some trees, bushes and benches, all of them outside the ring."""

    def __init__(self, plot: Plot, centre: Point, ring: float) -> None:
        self._plot, self._centre, self._ring = plot, centre, ring
        self._count = 0

    def build(self) -> None:
        x, y = self._centre
        reach = self._ring + 26.0
        within = (x - reach, y - reach, x + reach, y + reach)
        self._car_park()
        self._plot.scatter(22, lambda _, at: grow_tree(self._plot, self._named(ObstacleKind.TREE), at), within)
        self._plot.scatter(14, self._bush, within)
        self._plot.scatter(5, self._shed, within)

    def paving(self, building: Footprint) -> tuple[Strip, ...]:
        x, y = self._centre
        (half_x, half_y), c, s = building.half, math.cos(building.yaw), math.sin(building.yaw)

        def around(forward: float) -> Point:
            return x + c * forward, y + s * forward

        south = y - self._ring - 10.0
        return (
            Strip((x - 28.0, south), (x + 28.0, south), 16.0, ASPHALT),
            Strip((x, y), (x, south), 3.5, FOOTWAY),
            Strip(around(-half_x - 3.0), around(half_x + 3.0), 2 * half_y + 6.0, FOOTWAY),
        )

    def _named(self, kind: ObstacleKind) -> str:
        self._count += 1
        return f"{kind}-{self._count}"

    def _car_park(self) -> None:
        """Two rows of cars south of the ring, and lamps."""
        plot, (x, y) = self._plot, self._centre
        for row, heading in ((y - self._ring - 4.8, math.pi / 2), (y - self._ring - 15.0, -math.pi / 2)):
            for place in np.arange(x - 25.0, x + 25.0, 2.9).tolist():
                if plot.chance(0.55):
                    paint = plot.one_of(PAINTS)
                    plot.add(car(self._named(ObstacleKind.VEHICLE), (place, row), heading, paint), spacing=0.3)
        for place in (x - 20.0, x, x + 20.0):
            plot.add(lamp(self._named(ObstacleKind.POLE), (place, y - self._ring - 18.5), math.pi / 2, 7.0, 1.5))

    def _bush(self, _: str, at: Point) -> Obstacle:
        plot = self._plot
        outline = Footprint(at, (plot.between(0.6, 2.2), plot.between(0.5, 0.9)), plot.between(0.0, math.pi))
        return block(self._named(ObstacleKind.WALL), ObstacleKind.WALL, outline, plot.between(0.7, 1.5), BUSH)

    def _shed(self, _: str, at: Point) -> Obstacle:
        plot = self._plot
        outline = Footprint(at, (plot.between(1.2, 2.5), plot.between(1.0, 1.8)), plot.between(0.0, math.pi))
        return block(self._named(ObstacleKind.BOX), ObstacleKind.BOX, outline, plot.between(2.0, 2.8))
