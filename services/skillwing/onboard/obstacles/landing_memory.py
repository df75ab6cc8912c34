"""Memory of the ground for landings, whichever sensor the depth map is made from.

The LiDAR's ring sees the ground below the drone. Otherwise the camera sees some of it ahead, and the range-finder a
line under the track. A drone often lands where it no longer sees the ground, such as over the home pad with a camera
that looks ahead. But it has been there before. So this memory lasts for the whole flight, while the drone's position is
certain. Measurements at an uncertain position count for seconds, and are dropped once the position is certain again.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from skillwing.onboard.frames.vectors import Vector
from skillwing.onboard.obstacles.free_space import TUBE_RADIUS, Sighting
from skillwing.onboard.obstacles.landing_place import SURROUNDINGS
from skillwing.onboard.obstacles.local_map import AGREEING, LocalMap
from skillwing.onboard.topics.navigation import Navigation
from skillwing.onboard.topics.obstacles import ObstacleSource

Points = NDArray[np.float64]
Mask = NDArray[np.bool_]

PERIOD: Final = 0.5
"""Period of a sensor's measurements [s]: at 2 m/s and 4 m above ground the LiDAR's ring sees each place twice."""
SURE: Final = 0.3
"""Largest standard deviation of a certain position, at which the drone finds old places again [m]."""
READINGS: Final = 10
"""Number of range-finder readings inserted at once."""
_SPAN = 150.0
"""Radius of the memory [m]."""


class LandingMemory:
    """Memory of obstacles and ground below and around the drone, from a measurement now and then."""

    def __init__(self) -> None:
        self._placed = LocalMap(_SPAN, memory=np.inf)
        self._unplaced = LocalMap(_SPAN)
        self._looked: dict[ObstacleSource, float] = {}
        self._met: list[Vector] = []
        self._sure = False

    def follow(self, navigation: Navigation) -> None:
        """Take navigation's certainty. Once the position is certain again, measurements made meanwhile are in the wrong
        place; earlier ones are not."""
        sure = navigation.valid and max(navigation.sigma, navigation.height_sigma) <= SURE
        if sure is self._sure:
            return
        self._sure = sure
        self._met.clear()
        if not sure:
            self._unplaced = self._placed.lately(navigation.t)

    def wants(self, sensor: ObstacleSource, t: float) -> bool:
        """Test for the need of a measurement of this sensor that ends at `t`."""
        if sensor is not ObstacleSource.LIDAR and self._ring_looks(t):
            return False
        return not self._has_looked(sensor, t, within=PERIOD)

    def see(self, sensor: ObstacleSource, sighting: Sighting) -> None:
        """Take a measurement. One older than the latest of its sensor clears the memory first: time was reset."""
        seen = sighting.seen
        if seen.stamp < self._looked.get(sensor, seen.stamp):
            self.forget()
        self._looked[sensor] = seen.stamp
        points, here = seen.points.astype(np.float64), seen.origin
        self._map.see(points[_matters(points, here)], here, seen.stamp, sighting.sees_through)

    def meet(self, t: float, place: Vector) -> None:
        """Take the place of a range-finder reading at `t`. Neighbouring readings confirm one another."""
        if self._ring_looks(t):
            self._met.clear()
            return
        self._met.append(place)
        if len(self._met) == READINGS:
            line = np.array(self._met)
            self._map.see(line, line[-1], t, lambda places: np.zeros(len(places), dtype=np.bool_), votes=AGREEING)
            self._met.clear()

    def drop_line(self) -> None:
        """Drop the present line after a failure of the range-finder: its last distances may be wrong. Complete lines
        stay: the self-test takes about a second, in which at most two of them can be wrong."""
        self._met.clear()

    def known(self, t: float) -> LocalMap | None:
        """The map at time `t`; None if it is empty. At an uncertain position it holds only recent measurements."""
        known = self._placed if self._sure else self._unplaced.lately(t)
        return known if len(known) else None

    def forget(self) -> None:
        self._looked.clear()
        self._met.clear()
        self._placed.forget()
        self._unplaced.forget()

    @property
    def _map(self) -> LocalMap:
        """The map that measurements go into now."""
        return self._placed if self._sure else self._unplaced

    def _ring_looks(self, t: float) -> bool:
        return self._has_looked(ObstacleSource.LIDAR, t, within=2.0 * PERIOD)

    def _has_looked(self, sensor: ObstacleSource, t: float, within: float) -> bool:
        return 0.0 <= t - self._looked.get(sensor, -np.inf) < within


def _matters(places: Points, here: Points) -> Mask:
    """Mask of the places (N, 3) that matter to a landing from `here` (3,)."""
    x, y, z = places.T
    near = (np.abs(x - here[0]) <= SURROUNDINGS) & (np.abs(y - here[1]) <= SURROUNDINGS)
    return near & (z <= here[2] + TUBE_RADIUS)
