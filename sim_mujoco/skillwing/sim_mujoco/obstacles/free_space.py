"""How far the way to guidance's target is free, from the points of one sensor that looks that way.

The way is a tube around the straight line from the drone to its target, as wide as the hull with a margin. An
obstacle is several points close together in that tube; two measurements have to agree on it. Measurements are
remembered for a moment: a single poor one then does not change the answer, and what has come too close to be inside
the picture is still known.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from skillwing.sim_mujoco.frames.vectors import Vector
from skillwing.sim_mujoco.sensors.scans import PlacedPoints, Points
from skillwing.sim_mujoco.topics import DepthHeader

TUBE_RADIUS: Final = 1.3
"""Hull radius of 0.65 m, and as much again for drift and noise [m]."""
MEMORY: Final = 1.5
"""How long points are remembered [s]."""
STALE: Final = 0.5
"""A look along the way that is older than this says nothing any more [s]."""
_CLUSTER, _CLUSTER_LENGTH = 5, 0.5
"""An obstacle is so many points of one measurement within so many metres along the way."""
_AGREEING = 2
_SLACK = 0.5
"""What lies beside a field of view by no more than this is still inside the tube that is in view [m]."""
_ON_THE_MOVE = 0.3


class View(Protocol):
    """Where a sensor looks, and how far it can be relied on."""

    @property
    def horizon(self) -> float: ...
    def contains(self, place: Vector) -> bool:
        """Whether a place, FLU [m] from the drone, lies in the field of view, be it beyond the horizon."""
        ...

    def axis(self, heading: float, velocity: NDArray[np.float64]) -> NDArray[np.float64] | None:
        """The level direction of view, or of motion for a sensor that looks all around; None at rest."""
        ...


@dataclass(frozen=True, slots=True)
class CameraView:
    """A pyramid around the body's x axis; `across` and `upright` are the tangents of its half angles."""

    across: float
    upright: float
    horizon: float = 20.0

    @staticmethod
    def of(header: DepthHeader) -> CameraView:
        return CameraView(header.width / 2 / header.fx, header.height / 2 / header.fy)

    def contains(self, place: Vector) -> bool:
        ahead, left, up = place
        reach = max(ahead, 0.0)
        return (
            ahead > -_SLACK and abs(left) <= self.across * reach + _SLACK and abs(up) <= self.upright * reach + _SLACK
        )

    def axis(self, heading: float, velocity: NDArray[np.float64]) -> NDArray[np.float64] | None:
        return np.array([math.cos(heading), math.sin(heading), 0.0])


@dataclass(frozen=True, slots=True)
class RingView:
    """A ring orthogonal to the body's x axis, so thick. Beyond the horizon its beams are 0.9 m apart."""

    half_angle: float = math.radians(12.0)
    horizon: float = 25.0

    def contains(self, place: Vector) -> bool:
        return abs(place[0]) <= max(_SLACK, math.sin(self.half_angle) * math.hypot(*place))

    def axis(self, heading: float, velocity: NDArray[np.float64]) -> NDArray[np.float64] | None:
        speed = math.hypot(velocity[0], velocity[1])
        if speed < _ON_THE_MOVE:
            return None
        direction = np.array([velocity[0] / speed, velocity[1] / speed, 0.0])
        out_of_plane = direction[0] * math.cos(heading) + direction[1] * math.sin(heading)
        return direction if abs(out_of_plane) <= math.sin(self.half_angle) else None


@dataclass(frozen=True, slots=True)
class Sighting:
    """One measurement: its points in the world, and where the sensor looked."""

    view: View
    seen: PlacedPoints

    def looks_at(self, place: NDArray[np.float64], here: NDArray[np.float64]) -> bool:
        """Whether `place` is in view from `here`, both in the world, with the attitude of this measurement."""
        x, y, z = (place - here) @ self.seen.turn
        return self.view.contains((float(x), float(y), float(z)))


@dataclass(frozen=True, slots=True)
class Outlook:
    """Fields as in `ObstacleStatus`."""

    free_distance: float | None
    ahead: float | None
    horizon: float
    stamp: float | None


class FreeSpace:
    """Remembers sightings of one sensor and judges ways by them."""

    def __init__(self) -> None:
        self._sightings: deque[Sighting] = deque()

    def see(self, sighting: Sighting) -> None:
        """Take in a measurement. One from before the latest begins a new memory: time was reset."""
        memory = self._sightings
        if memory and sighting.seen.stamp < memory[-1].seen.stamp:
            memory.clear()
        memory.append(sighting)
        while sighting.seen.stamp - memory[0].seen.stamp > MEMORY:
            memory.popleft()

    def forget(self) -> None:
        """Another sensor begins from nothing."""
        self._sightings.clear()

    def outlook(self, t: float, position: Vector, velocity: Vector, heading: float, target: Vector | None) -> Outlook:
        """What the sensor says at time `t` of the way from `position` to `target`, and of the direction of view.

        The stamp is that of the latest look along the way; without a target, or if there was none lately, that of
        the latest measurement, and nothing is said about the way.
        """
        if not self._sightings:
            return Outlook(None, None, 0.0, None)
        latest = self._sightings[-1]
        here, horizon, stamp = np.array(position), latest.view.horizon, latest.seen.stamp
        if t - stamp > STALE:
            return Outlook(None, None, horizon, stamp)
        axis = latest.view.axis(heading, np.array(velocity))
        ahead = None if axis is None else self._nearest(here, axis, horizon)
        free = None
        if target is not None:
            looked = self._latest_look(t, here, np.array(target))
            if looked is not None:
                free, stamp = self._free_distance(here, np.array(target), horizon), looked
        return Outlook(free, ahead, horizon, stamp)

    def _latest_look(self, t: float, here: NDArray[np.float64], target: NDArray[np.float64]) -> float | None:
        for sighting in reversed(self._sightings):
            if t - sighting.seen.stamp > STALE:
                return None
            if sighting.looks_at(target, here):
                return sighting.seen.stamp
        return None

    def _free_distance(self, here: NDArray[np.float64], target: NDArray[np.float64], horizon: float) -> float:
        way = target - here
        length = float(np.linalg.norm(way))
        if length < 1e-3:
            return length
        nearest = self._nearest(here, way / length, min(length + TUBE_RADIUS, horizon))
        if nearest is None:
            return min(length, horizon)
        if nearest > length:
            # It stands just behind the target, so the last part of the way is too close to it.
            return max(0.0, nearest - TUBE_RADIUS)
        return nearest

    def _nearest(self, here: NDArray[np.float64], direction: NDArray[np.float64], reach: float) -> float | None:
        """Distance along the tube of the nearest obstacle that two sightings know, the only one if there is one."""
        distances = [_nearest_cluster(each.seen.points, here, direction, reach) for each in self._sightings]
        distance = sorted(distances)[min(_AGREEING, len(distances)) - 1]
        return distance if math.isfinite(distance) else None


def _nearest_cluster(points: Points, here: NDArray[np.float64], direction: NDArray[np.float64], reach: float) -> float:
    """Where along the tube the nearest cluster of points begins [m]; infinity if there is none within reach."""
    away = points - here.astype(np.float32)
    along = away @ direction.astype(np.float32)
    near = (along > 0.0) & (along < reach)
    away, along = away[near], along[near]
    inside = np.einsum("ij,ij->i", away, away) - along * along < TUBE_RADIUS**2
    along = np.sort(along[inside])
    if len(along) < _CLUSTER:
        return math.inf
    starts = np.flatnonzero(along[_CLUSTER - 1 :] - along[: 1 - _CLUSTER] <= _CLUSTER_LENGTH)
    return float(along[starts[0]]) if len(starts) else math.inf
