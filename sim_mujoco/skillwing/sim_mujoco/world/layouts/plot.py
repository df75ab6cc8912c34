"""The plot of a world: it takes only obstacles that keep the promises of every world.

An obstacle on a leg of the route can be passed on either side. Every other obstacle, of any height, keeps its
distance from the legs, the home pad and the ways round the obstacles on the legs. So the drone may land anywhere on its
route, and climb from there.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TypeAlias, TypeVar

import numpy as np

from skillwing.onboard.frames.vectors import Vector
from skillwing.sim_mujoco.world.footprint import Footprint, Point
from skillwing.sim_mujoco.world.site import Site
from skillwing.sim_mujoco.world.things.obstacle import Obstacle

T = TypeVar("T")
Leg: TypeAlias = tuple[Point, Point]

HOME: Point = (0.0, 0.0)
LEG_CLEARANCE = 2.5
"""Free distance between a leg and any obstacle that does not stand on it [m]."""
PAD_CLEARANCE = 5.0
"""Free distance around the home pad [m]."""
SPACING = 1.0
MAX_ASIDE = 0.2
"""Largest offset of an obstacle from its leg; less than the radius of the thinnest pole there [m]."""
PASSAGE_HALF_LENGTH = 5.0


@dataclass(frozen=True, slots=True)
class Spot:
    """A place on a leg, and the leg's direction there [rad]."""

    leg: int
    centre: Point
    yaw: float


def legs_of(way: Sequence[Vector]) -> tuple[Leg, ...]:
    """The legs between the places of a way, in plan."""
    return tuple((a[:2], b[:2]) for a, b in pairwise(way))


def distance_to_legs(outline: Footprint, legs: Sequence[Leg]) -> float:
    """Distance from an outline to the nearest leg [m]."""
    return min(outline.distance_to_segment(a, b) for a, b in legs)


def passage(obstacle: Obstacle, legs: Sequence[Leg], width: float) -> Footprint:
    """The ground that must stay free so that an obstacle on a leg can be passed on both sides."""
    assert obstacle.leg is not None
    a, b = legs[obstacle.leg]
    bearing = math.atan2(b[1] - a[1], b[0] - a[0])
    reach = max(obstacle.footprint.half) + obstacle.footprint.radius + width
    return Footprint(obstacle.footprint.centre, (PASSAGE_HALF_LENGTH, reach), bearing)


class Plot:
    """Obstacles of a world, added one by one; `keep_free` is further ground without obstacles."""

    def __init__(
        self,
        rng: np.random.Generator,
        site: Site,
        *,
        keep_free: Sequence[Footprint] = (),
    ) -> None:
        self._rng = rng
        self._passage = site.passage
        self._keep_free = list(keep_free)
        self._placed: list[Obstacle] = []
        self._circles = np.empty((0, 3))
        self.legs = legs_of(site.way)

    @property
    def obstacles(self) -> tuple[Obstacle, ...]:
        return tuple(self._placed)

    def between(self, low: float, high: float) -> float:
        return float(self._rng.uniform(low, high))

    def chance(self, probability: float) -> bool:
        return float(self._rng.random()) < probability

    def one_of(self, choices: Sequence[T]) -> T:
        return choices[int(self._rng.integers(len(choices)))]

    def spot(self, leg: int, share: tuple[float, float]) -> Spot:
        """A random spot on the part of a leg between two shares of its length, with a small offset."""
        (ax, ay), (bx, by) = self.legs[leg]
        at = self.between(*share)
        yaw = math.atan2(by - ay, bx - ax)
        aside = self.between(-MAX_ASIDE, MAX_ASIDE)
        return Spot(
            leg, (ax + at * (bx - ax) - aside * math.sin(yaw), ay + at * (by - ay) + aside * math.cos(yaw)), yaw
        )

    def block(self, leg: int, obstacle: Obstacle) -> bool:
        """Put an obstacle on a leg if its passage is free; from now on the passage stays free."""
        obstacle = replace(obstacle, leg=leg)
        way_round = passage(obstacle, self.legs, self._passage)
        if any(way_round.distance_to_footprint(other.footprint) == 0.0 for other in self._placed):
            return False
        if any(zone.distance_to_footprint(obstacle.footprint) == 0.0 for zone in self._keep_free):
            return False
        self._put(obstacle)
        self._keep_free.append(way_round)
        return True

    def add(self, obstacle: Obstacle, *, spacing: float = SPACING) -> bool:
        """Add an obstacle if it keeps the promises and its distance from the others; 0 lets it touch them."""
        if not self.fits(obstacle.footprint, spacing):
            return False
        self._put(obstacle)
        return True

    def scatter(
        self,
        count: int,
        make: Callable[[str, Point], Obstacle],
        within: tuple[float, float, float, float],
        *,
        tries: int = 40,
    ) -> None:
        """Place `count` objects at random between the west, south, east and north border, as far as there is room.

        make: the object for a number, as the end of its name, and a place.
        """
        west, south, east, north = within
        placed = 0
        for _ in range(tries * count):
            at = self.between(west, east), self.between(south, north)
            placed += self.add(make(str(placed), at))
            if placed == count:
                return

    def fits(self, wanted: Footprint, spacing: float = SPACING) -> bool:
        """An object with this outline may stand there."""
        return (
            distance_to_legs(wanted, self.legs) >= LEG_CLEARANCE
            and wanted.distance_to(HOME) >= PAD_CLEARANCE
            and all(zone.distance_to_footprint(wanted) > 0.0 for zone in self._keep_free)
            and (spacing <= 0.0 or self._is_apart(wanted, spacing))
        )

    def _is_apart(self, wanted: Footprint, spacing: float) -> bool:
        x, y, reach = _circle(wanted)
        gaps = np.hypot(self._circles[:, 0] - x, self._circles[:, 1] - y) - self._circles[:, 2] - reach
        near = np.flatnonzero(gaps < spacing).tolist()
        return all(self._placed[other].footprint.distance_to_footprint(wanted) >= spacing for other in near)

    def _put(self, obstacle: Obstacle) -> None:
        self._placed.append(obstacle)
        self._circles = np.vstack([self._circles, _circle(obstacle.footprint)])


def _circle(outline: Footprint) -> tuple[float, float, float]:
    """Centre and radius of a circle around an outline: most are too far apart to be measured exactly."""
    return *outline.centre, math.hypot(*outline.half) + outline.radius
