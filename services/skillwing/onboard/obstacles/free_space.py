"""Free distance along a way: the drone with a margin, swept along it through the local map of one sensor.

A way is known only while the sensor looks along it; the local map then adds obstacles that have left the field of view.
No test for line of sight is needed: a ray from the drone to any point in the tube around a straight way runs inside it.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray

from skillwing.onboard.frames.extent import TIP_RADIUS
from skillwing.onboard.frames.vectors import Vector
from skillwing.onboard.obstacles.local_map import LocalMap
from skillwing.onboard.obstacles.views import SensorView
from skillwing.onboard.sensor_data.scans import PlacedPoints

Points = NDArray[np.float64]
Mask = NDArray[np.bool_]

TUBE_RADIUS: Final = TIP_RADIUS + 0.6
"""Radius of the drone, with room for drift, noise and the size of voxels [m]."""
NARROW: Final = TIP_RADIUS + 0.4
"""Least radius of the tube, for a drone near an obstacle [m]."""
STALE: Final = 0.5
"""Largest age of a look along the way [s]."""
_CLEAR = 0.1
"""Clearance between the tube and an obstacle near the drone [m]."""
_CLUSTER, _CLUSTER_LENGTH = 3, 0.5
"""Fewest voxels of an obstacle, and their longest extent along the way [m]."""


@dataclass(frozen=True, slots=True)
class Sighting:
    """One measurement: its points in the world, and the sensor's view."""

    view: SensorView
    seen: PlacedPoints

    def looks_at(self, place: Points, here: Points) -> bool:
        """Test for `place` in view from `here`, both in the world, with the attitude of this measurement."""
        x, y, z = (place - here) @ self.seen.turn
        return self.view.contains((float(x), float(y), float(z)))

    def sees_through(self, places: Points) -> Mask:
        """Mask of the places (N, 3), in the world, that a ray has passed on its way to a farther return."""
        return self.view.sees_through((self.seen.turn.T @ (places - self.seen.origin).T).T)


@dataclass(frozen=True, slots=True)
class Outlook:
    """Fields as in `ObstacleStatus`."""

    free_distance: float | None
    ahead: float | None
    horizon: float
    stamp: float | None


class FreeSpace:
    """Local map of one sensor, and the free distance along ways in it."""

    def __init__(self) -> None:
        self._map = LocalMap()
        self._looks: deque[Sighting] = deque()

    def see(self, sighting: Sighting) -> None:
        """Take a measurement. One older than the latest clears the map first: time was reset."""
        looks, seen = self._looks, sighting.seen
        if looks and seen.stamp < looks[-1].seen.stamp:
            self.forget()
        looks.append(sighting)
        while seen.stamp - looks[0].seen.stamp > STALE:
            looks.popleft()
        self._map.see(seen.points.astype(np.float64), seen.origin, seen.stamp, sighting.sees_through)

    def forget(self) -> None:
        """Clear the map, for another sensor."""
        self._looks.clear()
        self._map.forget()

    def outlook(
        self, t: float, position: Vector, velocity: Vector, heading: float, way: Sequence[Vector] = ()
    ) -> Outlook:
        """Outlook at `t` along the way from `position` over these corners, and in the direction of view.

        The stamp is that of the latest look along the way. Without a way, or without a recent look, it is that of the
        latest measurement, and the free distance is None.
        """
        if not self._looks:
            return Outlook(None, None, 0.0, None)
        latest = self._looks[-1]
        stamp, view = latest.seen.stamp, latest.view
        if t - stamp > STALE:
            return Outlook(None, None, view.reach, stamp)
        here = np.array(position)
        axis = view.axis(heading, np.array(velocity))
        ahead = None if axis is None else _finite(_nearest(self._map, here, axis, view.sight, TUBE_RADIUS))
        corners = [here, *(np.array(corner) for corner in way)]
        looked = self._look_along(t, corners)
        if looked is None:
            return Outlook(None, ahead, view.reach, stamp)
        stamp, horizon = looked
        return Outlook(free_distance(self._map, corners, view.sight), ahead, horizon, stamp)

    def _look_along(self, t: float, corners: Sequence[Points]) -> tuple[float, float] | None:
        """Time of the last look along the way, and distance along it at which the sensor detects an obstacle."""
        for look in reversed(self._looks):
            if t - look.seen.stamp > STALE:
                return None
            in_view = 0
            for corner in corners[1:]:
                if not look.looks_at(corner, corners[0]):
                    break
                in_view += 1
            if in_view == len(corners) - 1 > 0:
                return look.seen.stamp, look.view.reach
            if in_view:
                return look.seen.stamp, min(look.view.reach, _length(corners[: in_view + 1]))
        return None


def free_distance(known: LocalMap, corners: Sequence[Points], sight: float) -> float:
    """Metres along the way to the first obstacle for the drone swept along it; at most `sight`.

    The drone needs room at the end of the way, too. So the free distance may exceed the length of the way: by the
    distance of an obstacle behind its end, or by the tube's radius without one.

    Near an obstacle the tube is as wide as the drone's distance from it: the drone may fly away or along it, but not
    nearer.
    """
    here, end = corners[0], corners[-1]
    flown, radius = 0.0, _tube_radius(known, here)
    for a, b in pairwise(corners):
        length = float(np.linalg.norm(b - a))
        if length < 1e-3:
            continue
        in_sight = min(length, sight - flown)
        room = radius if b is end and in_sight == length else 0.0
        nearest = _nearest(known, a, (b - a) / length, in_sight, radius, room)
        if math.isfinite(nearest):
            return min(flown + nearest, sight)
        flown += length
        if flown >= sight:
            break
    return min(flown + TUBE_RADIUS, sight)


def _tube_radius(known: LocalMap, here: Points) -> float:
    counts = TUBE_RADIUS + _CLEAR
    solid = known.solid_within(here - counts, here + counts)
    if len(solid) < _CLUSTER:
        return TUBE_RADIUS
    gaps = np.partition(np.linalg.norm(solid - here, axis=1), _CLUSTER - 1)
    return float(np.clip(gaps[_CLUSTER - 1] - _CLEAR, NARROW, TUBE_RADIUS))


def _nearest(
    known: LocalMap, here: Points, direction: Points, length: float, radius: float, room: float = 0.0
) -> float:
    """Distance along a tube to its nearest cluster of points [m]; infinity if there is none.

    Points behind the end of the tube count within `room` of it, in any direction: a drone that hovers there may be some
    centimetres short of it or past it.
    """
    end = here + length * direction
    solid = known.solid_within(np.minimum(here, end) - radius, np.maximum(here, end) + radius)
    away = solid - here
    along = away @ direction
    aside = np.einsum("ij,ij->i", away, away) - along * along
    from_end = np.linalg.norm(solid - end, axis=1)
    in_tube = (along > 0.0) & (along <= length) & (aside < radius * radius)
    behind = (along > length) & (from_end < room)
    along = np.sort(np.concatenate([along[in_tube], length + from_end[behind]]))
    if len(along) < _CLUSTER:
        return math.inf
    starts = np.flatnonzero(along[_CLUSTER - 1 :] - along[: 1 - _CLUSTER] <= _CLUSTER_LENGTH)
    return float(along[starts[0]]) if len(starts) else math.inf


def _length(corners: Sequence[Points]) -> float:
    return sum(float(np.linalg.norm(b - a)) for a, b in pairwise(corners))


def _finite(distance: float) -> float | None:
    return distance if math.isfinite(distance) else None
