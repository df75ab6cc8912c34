"""A courtyard of 50 x 40 m: a building inside the route, up to three around it, walls, trees, poles and boxes."""

from __future__ import annotations

import math

import numpy as np

from skillwing.onboard.frames.extent import Box
from skillwing.onboard.frames.vectors import Vector
from skillwing.sim_mujoco.world.footprint import Footprint, Point
from skillwing.sim_mujoco.world.layouts.plot import Plot
from skillwing.sim_mujoco.world.site import Site
from skillwing.sim_mujoco.world.terrain import Terrain, make_terrain
from skillwing.sim_mujoco.world.things.obstacle import Obstacle, ObstacleKind
from skillwing.sim_mujoco.world.things.plain import block, building, pole, tree

ALTITUDE = 4.0
"""Height of the route above the home pad [m]."""
ROUTE: tuple[Vector, ...] = ((30.0, 0.0, ALTITUDE), (30.0, 20.0, ALTITUDE), (5.0, 20.0, ALTITUDE), (0.0, 0.0, ALTITUDE))
PASSAGE = 4.0
"""Free width on both sides of an obstacle that stands on a leg [m]."""
FENCE = Box((-12.0, -12.0, -1.0), (42.0, 32.0, 30.0))
BOUNDS = Box((-50.0, -50.0, -8.0), (80.0, 70.0, 24.0))
"""The courtyard and what can be seen from there."""
_SCATTERED = (-9.0, -9.0, 39.0, 29.0)


def courtyard_site(seed: int) -> Site:
    """The site of any courtyard; they have one size."""
    return Site(
        kind="courtyard",
        seed=seed,
        scale=1.0,
        route=ROUTE,
        area=(-11.0, -11.0, 41.0, 31.0),
        fence=FENCE,
        bounds=BOUNDS,
        ceiling=8.0,
        return_height=12.0,
        passage=PASSAGE,
    )


def make_courtyard(seed: int) -> tuple[Obstacle, ...]:
    """The obstacles of the courtyard with this seed; the same seed gives the same courtyard."""
    rng = np.random.default_rng(seed)
    return _Courtyard(rng, Plot(rng, courtyard_site(seed))).build()


def courtyard_terrain(seed: int) -> Terrain:
    return make_terrain(np.random.default_rng((seed, 1)), centre=(15.0, 10.0), half=(35.0, 30.0))


class _Courtyard:
    def __init__(self, rng: np.random.Generator, plot: Plot) -> None:
        self._rng, self._plot = rng, plot

    def build(self) -> tuple[Obstacle, ...]:
        self._block(leg=int(self._rng.integers(0, 2)))
        if self._plot.chance(0.5):
            self._block(leg=2)
        self._buildings()
        self._plot.scatter(4, self._wall, _SCATTERED)
        self._plot.scatter(7, self._tree, _SCATTERED)
        self._plot.scatter(5, self._pole, _SCATTERED)
        self._plot.scatter(9, self._box, _SCATTERED)
        return self._plot.obstacles

    def _block(self, leg: int) -> None:
        """Put a pole or a wall, higher than the route, into the middle part of a leg."""
        between = self._plot.between
        spot = self._plot.spot(leg, (0.4, 0.65))
        if self._plot.chance(0.5):
            footprint = Footprint(spot.centre, radius=between(0.25, 0.4))
            self._plot.block(leg, pole(f"pole-on-leg-{leg}", footprint, between(6.0, 8.0)))
        else:
            footprint = Footprint(spot.centre, (0.2, between(1.2, 2.2)), spot.yaw)
            self._plot.block(leg, block(f"wall-on-leg-{leg}", ObstacleKind.WALL, footprint, between(6.0, 8.0)))

    def _buildings(self) -> None:
        """One large building inside the route, and up to three more around it."""
        between = self._plot.between
        slots = [
            Footprint((14.5 + between(-1, 1), 10.0), (between(5.0, 6.5), between(2.5, 3.0))),
            Footprint((between(8, 22), -10.5), (between(3.0, 6.0), 1.8)),
            Footprint((39.0, between(4, 16)), (1.8, between(3.0, 5.0))),
            Footprint((between(12, 24), 29.5), (between(3.0, 6.0), 1.8)),
        ]
        wanted = int(self._rng.integers(2, 5))
        others = self._rng.permutation(np.arange(1, len(slots)))[: wanted - 1]
        for number, slot in enumerate([0, *others]):
            self._plot.add(building(f"building-{number}", slots[slot], between(5.5, 8.0)))

    def _wall(self, number: str, at: Point) -> Obstacle:
        between = self._plot.between
        yaw = math.pi / 2 * int(self._rng.integers(0, 2))
        footprint = Footprint(at, (between(1.5, 3.0), 0.15), yaw)
        return block(f"wall-{number}", ObstacleKind.WALL, footprint, between(1.5, 3.0))

    def _tree(self, number: str, at: Point) -> Obstacle:
        footprint = Footprint(at, radius=self._plot.between(1.0, 1.6))
        return tree(f"tree-{number}", footprint, self._plot.between(4.0, 6.5))

    def _pole(self, number: str, at: Point) -> Obstacle:
        footprint = Footprint(at, radius=self._plot.between(0.1, 0.25))
        return pole(f"pole-{number}", footprint, self._plot.between(4.0, 7.5))

    def _box(self, number: str, at: Point) -> Obstacle:
        between = self._plot.between
        footprint = Footprint(at, (between(0.4, 1.2), between(0.4, 1.2)), between(0.0, math.pi))
        return block(f"box-{number}", ObstacleKind.BOX, footprint, between(0.8, 2.4))
