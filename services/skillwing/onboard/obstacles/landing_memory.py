"""What was seen of the ground, for landings, whichever sensor the depth map is made from.

The LiDAR's ring sees the ground below the drone; where it does not look, the camera sees some of it ahead, and the
range-finder a line under the track. A drone often lands where it sees no ground any more, such as over the home pad
with a camera that looks ahead. But it has been there before: so this memory lasts for the whole flight, as long as the
drone knows where it is. What it sees while it does not know counts for seconds, and not at all once it knows again.
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
"""Between two looks of a sensor [s]: at 2 m/s and 4 m above the ground the LiDAR's ring still sees each place twice."""
SURE: Final = 0.3
"""Navigation that is as sure as this of the position finds places again, however long ago they were seen [m]."""
READINGS: Final = 10
"""So many readings of the range-finder are taken in at once."""
_SPAN = 150.0
"""What is farther away than this is forgotten all the same [m]."""


class LandingMemory:
    """Remembers what stands below and around the drone, by a look now and then."""

    def __init__(self) -> None:
        self._placed = LocalMap(_SPAN, memory=np.inf)
        self._unplaced = LocalMap(_SPAN)
        self._looked: dict[ObstacleSource, float] = {}
        self._met: list[Vector] = []
        self._sure = False

    def follow(self, navigation: Navigation) -> None:
        """Take what navigation says of itself. Where it has found its place again, what was seen meanwhile is not where
        it seemed to be; but what was seen before is."""
        sure = navigation.valid and max(navigation.sigma, navigation.height_sigma) <= SURE
        if sure is self._sure:
            return
        self._sure = sure
        self._met.clear()
        if not sure:
            self._unplaced = self._placed.lately(navigation.t)

    def wants(self, sensor: ObstacleSource, t: float) -> bool:
        """Whether it is time for a measurement of this sensor that ends at `t`."""
        if sensor is not ObstacleSource.LIDAR and self._ring_looks(t):
            return False
        return not self._has_looked(sensor, t, within=PERIOD)

    def see(self, sensor: ObstacleSource, sighting: Sighting) -> None:
        """Take in a measurement. One from before the latest of its sensor begins a new memory: time was reset."""
        seen = sighting.seen
        if seen.stamp < self._looked.get(sensor, seen.stamp):
            self.forget()
        self._looked[sensor] = seen.stamp
        points, here = seen.points.astype(np.float64), seen.origin
        self._map.see(points[_matters(points, here)], here, seen.stamp, sighting.sees_through)

    def meet(self, t: float, place: Vector) -> None:
        """The range-finder has met something at `t` in this place. Neighbouring readings agree with one another."""
        if self._ring_looks(t):
            self._met.clear()
            return
        self._met.append(place)
        if len(self._met) == READINGS:
            line = np.array(self._met)
            self._map.see(line, line[-1], t, lambda places: np.zeros(len(places), dtype=np.bool_), votes=AGREEING)
            self._met.clear()

    def drop_line(self) -> None:
        """The range-finder has failed: it may have told wrong distances before it found out. Whole lines stay; it finds
        out within about a second, in which two of them can be wrong."""
        self._met.clear()

    def known(self, t: float) -> LocalMap | None:
        """What is known at time `t`; None if nothing is. A drone that is not sure of its place believes only what it
        has seen lately."""
        known = self._placed if self._sure else self._unplaced.lately(t)
        return known if len(known) else None

    def forget(self) -> None:
        self._looked.clear()
        self._met.clear()
        self._placed.forget()
        self._unplaced.forget()

    @property
    def _map(self) -> LocalMap:
        """What measurements are taken into now."""
        return self._placed if self._sure else self._unplaced

    def _ring_looks(self, t: float) -> bool:
        return self._has_looked(ObstacleSource.LIDAR, t, within=2.0 * PERIOD)

    def _has_looked(self, sensor: ObstacleSource, t: float, within: float) -> bool:
        return 0.0 <= t - self._looked.get(sensor, -np.inf) < within


def _matters(places: Points, here: Points) -> Mask:
    """Which places (N, 3) matter to a drone that lands from `here` (3,)."""
    x, y, z = places.T
    near = (np.abs(x - here[0]) <= SURROUNDINGS) & (np.abs(y - here[1]) <= SURROUNDINGS)
    return near & (z <= here[2] + TUBE_RADIUS)
