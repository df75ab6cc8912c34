"""Where things stand in a courtyard: pure geometry drawn from a seed, before any physics is built.

The layout keeps three promises, whatever the seed: one tall obstacle stands on a leg of the route, every
obstacle on a leg can be passed on either side, and everything else keeps its distance from the legs and the pad.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise

import numpy as np

from skillwing.sim_mujoco.world.footprint import Footprint, Point

HOME: Point = (0.0, 0.0)
ALTITUDE = 4.0
"""Height of the route above the home pad [m]."""
ROUTE: tuple[tuple[float, float, float], ...] = (
    (0.0, 0.0, ALTITUDE),
    (30.0, 0.0, ALTITUDE),
    (30.0, 20.0, ALTITUDE),
    (5.0, 20.0, ALTITUDE),
    (0.0, 0.0, ALTITUDE),
)
LEGS: tuple[tuple[Point, Point], ...] = tuple((a[:2], b[:2]) for a, b in pairwise(ROUTE))

LEG_CLEARANCE = 2.5
"""Free distance between a leg and any obstacle that does not stand on it [m]."""
PASSAGE = 4.0
"""Free width on both sides of an obstacle that stands on a leg [m]."""
PAD_CLEARANCE = 5.0
"""Free distance around the home pad [m]."""
_SPACING = 1.0
_MAX_ASIDE = 0.2
"""How far off a leg the middle of its obstacle may stand; less than the radius of the thinnest pole there [m]."""


class Kind(StrEnum):
    """What an obstacle is; its surface label follows from it."""

    BUILDING = "building"
    WALL = "wall"
    POLE = "pole"
    TREE = "tree"
    BOX = "box"


@dataclass(frozen=True, slots=True)
class Obstacle:
    """One thing standing on the ground: outline, height above the pad [m], and the leg it blocks, if any."""

    name: str
    kind: Kind
    footprint: Footprint
    height: float
    leg: int | None = None


def distance_to_legs(footprint: Footprint) -> float:
    """Distance from an outline to the nearest leg of the route [m]."""
    return min(footprint.distance_to_segment(a, b) for a, b in LEGS)


def passage(obstacle: Obstacle) -> Footprint:
    """The ground that must stay free so that an obstacle on a leg can be passed on both sides."""
    assert obstacle.leg is not None
    a, b = LEGS[obstacle.leg]
    along = math.atan2(b[1] - a[1], b[0] - a[0])
    reach = max(obstacle.footprint.half) + obstacle.footprint.radius + PASSAGE
    return Footprint(obstacle.footprint.centre, (5.0, reach), along)


def make_courtyard(seed: int) -> tuple[Obstacle, ...]:
    """The obstacles of the courtyard with this seed; the same seed gives the same courtyard."""
    return _Courtyard(np.random.default_rng(seed)).build()


class _Courtyard:
    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng
        self._placed: list[Obstacle] = []
        self._passages: list[Footprint] = []

    def build(self) -> tuple[Obstacle, ...]:
        self._block(leg=int(self._rng.integers(0, 2)))
        if self._rng.random() < 0.5:
            self._block(leg=2)
        self._buildings()
        self._scatter(Kind.WALL, 4, self._wall)
        self._scatter(Kind.TREE, 7, self._tree)
        self._scatter(Kind.POLE, 5, self._pole)
        self._scatter(Kind.BOX, 9, self._box)
        return tuple(self._placed)

    def _between(self, low: float, high: float) -> float:
        return float(self._rng.uniform(low, high))

    def _block(self, leg: int) -> None:
        """Stand a pole or a wall, higher than the route, in the middle part of a leg."""
        (ax, ay), (bx, by) = LEGS[leg]
        at = self._between(0.4, 0.65)
        along = math.atan2(by - ay, bx - ax)
        aside = self._between(-_MAX_ASIDE, _MAX_ASIDE)
        centre = ax + at * (bx - ax) - aside * math.sin(along), ay + at * (by - ay) + aside * math.cos(along)
        if self._rng.random() < 0.5:
            kind, footprint = Kind.POLE, Footprint(centre, radius=self._between(0.25, 0.4))
        else:
            kind, footprint = Kind.WALL, Footprint(centre, (0.2, self._between(1.2, 2.2)), along)
        obstacle = Obstacle(f"{kind}-on-leg-{leg}", kind, footprint, self._between(6.0, 8.0), leg)
        self._placed.append(obstacle)
        self._passages.append(passage(obstacle))

    def _buildings(self) -> None:
        """One large building inside the route, and up to three more around it."""
        slots = [
            Footprint((14.5 + self._between(-1, 1), 10.0), (self._between(5.0, 6.5), self._between(2.5, 3.0))),
            Footprint((self._between(8, 22), -10.5), (self._between(3.0, 6.0), 1.8)),
            Footprint((39.0, self._between(4, 16)), (1.8, self._between(3.0, 5.0))),
            Footprint((self._between(12, 24), 29.5), (self._between(3.0, 6.0), 1.8)),
        ]
        wanted = int(self._rng.integers(2, 5))
        others = self._rng.permutation(np.arange(1, len(slots)))[: wanted - 1]
        for number, slot in enumerate([0, *others]):
            height = self._between(5.5, 8.0)
            self._try(Obstacle(f"building-{number}", Kind.BUILDING, slots[slot], height))

    def _scatter(self, kind: Kind, count: int, draw: Callable[[Point], tuple[Footprint, float]]) -> None:
        placed = 0
        for _ in range(40 * count):
            footprint, height = draw((self._between(-9.0, 39.0), self._between(-9.0, 29.0)))
            if self._try(Obstacle(f"{kind}-{placed}", kind, footprint, height)):
                placed += 1
            if placed == count:
                return

    def _wall(self, at: Point) -> tuple[Footprint, float]:
        yaw = math.pi / 2 * int(self._rng.integers(0, 2))
        return Footprint(at, (self._between(1.5, 3.0), 0.15), yaw), self._between(1.5, 3.0)

    def _tree(self, at: Point) -> tuple[Footprint, float]:
        return Footprint(at, radius=self._between(1.0, 1.6)), self._between(4.0, 6.5)

    def _pole(self, at: Point) -> tuple[Footprint, float]:
        return Footprint(at, radius=self._between(0.1, 0.25)), self._between(4.0, 7.5)

    def _box(self, at: Point) -> tuple[Footprint, float]:
        half = self._between(0.4, 1.2), self._between(0.4, 1.2)
        return Footprint(at, half, self._between(0.0, math.pi)), self._between(0.8, 2.4)

    def _try(self, obstacle: Obstacle) -> bool:
        if not self._fits(obstacle.footprint, self._passages, [o.footprint for o in self._placed]):
            return False
        self._placed.append(obstacle)
        return True

    @staticmethod
    def _fits(wanted: Footprint, keep_free: Sequence[Footprint], taken: Sequence[Footprint]) -> bool:
        return (
            distance_to_legs(wanted) >= LEG_CLEARANCE
            and wanted.distance_to(HOME) >= PAD_CLEARANCE
            and all(zone.distance_to_footprint(wanted) > 0.0 for zone in keep_free)
            and all(other.distance_to_footprint(wanted) >= _SPACING for other in taken)
        )
