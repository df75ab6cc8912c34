"""Views of the two ranging sensors: field of view, reach, and the free space that a measurement sees through.

Axes are the body's (FLU) [m].
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from skillwing.onboard.frames.vectors import Vector
from skillwing.onboard.sensor_data.directions import DEPTH_NOISE, LIDAR_HALF_FAN
from skillwing.onboard.sensor_data.scans import DepthPicture, LidarScan

Points = NDArray[np.float64]
Mask = NDArray[np.bool_]
Image = NDArray[np.float32]

THINNEST: Final = 0.2
"""Width of the thinnest pole that a sensor has to detect within its reach [m]."""
_SLACK = 0.5
"""Margin of the field of view, inside of the drone's own width [m]."""
_BEYOND = 0.4
"""Least distance of a return behind a place that it has seen through [m], plus the sensor's noise."""
_ON_THE_MOVE = 0.3


class SensorView(Protocol):
    """View of a sensor with one measurement."""

    @property
    def sight(self) -> float:
        """Largest range of returns in use [m]."""
        ...

    @property
    def reach(self) -> float:
        """Largest distance at which even a thin pole gives enough returns [m]."""
        ...

    def contains(self, place: Vector) -> bool:
        """Test for a place, from the drone's centre, in the field of view, at any range."""
        ...

    def axis(self, heading: float, velocity: Points) -> Points | None:
        """The level direction of view, or of motion for a sensor that looks all around; None at rest."""
        ...

    def sees_through(self, places: Points) -> Mask:
        """Mask of the places (N, 3), from the sensor, that a ray has passed on its way to a farther return."""
        ...


@dataclass(frozen=True, slots=True)
class CameraView:
    """A pyramid around the body's x axis; `across` and `upright` are the tangents of its half angles. `nearest`
    (rows, columns) is the least depth [m] around each block of pixels, infinity where it is unknown.

    At the reach the depth noise (`DEPTH_NOISE`) is 0.3 m, the side of a voxel; a pole of 0.2 m is more than two pixels
    wide there.
    """

    across: float
    upright: float
    nearest: Image = field(default_factory=lambda: np.full((1, 1), np.inf, dtype=np.float32))
    sight: float = 20.0
    reach: float = 14.0

    @staticmethod
    def of(picture: DepthPicture) -> CameraView:
        header = picture.header
        depth = picture.in_blocks
        known = np.where((depth > 0.0) & (depth < 60.0), depth, np.float32(np.inf))
        return CameraView(header.width / 2 / header.fx, header.height / 2 / header.fy, _least_around(known, wrap=False))

    def contains(self, place: Vector) -> bool:
        ahead, left, up = place
        depth = max(ahead, 0.0)
        return (
            ahead > -_SLACK and abs(left) <= self.across * depth + _SLACK and abs(up) <= self.upright * depth + _SLACK
        )

    def axis(self, heading: float, velocity: Points) -> Points | None:
        return np.array([math.cos(heading), math.sin(heading), 0.0])

    def sees_through(self, places: Points) -> Mask:
        depth, left, up = places.T
        wide, high = self.across * depth, self.upright * depth
        ahead = np.flatnonzero((depth > 0.1) & (np.abs(left) < wide) & (np.abs(up) < high))
        rows, columns = self.nearest.shape
        row = _cell(up.take(ahead) / high.take(ahead), rows)
        column = _cell(left.take(ahead) / wide.take(ahead), columns)
        seen = np.where(np.isfinite(self.nearest), self.nearest, 0.0)
        through = np.zeros(len(places), dtype=np.bool_)
        through[ahead] = (seen - 3 * DEPTH_NOISE * seen * seen - _BEYOND)[row, column] > depth.take(ahead)
        return through


@dataclass(frozen=True, slots=True)
class RingView:
    """A ring orthogonal to the body's x axis, `half_angle` thick to each side. `nearest` (columns, beams) is the least
    range [m] around each block of its directions, infinity where it is unknown.

    At the reach two neighbouring beams are as far apart as the thinnest pole is wide. Farther away the pole could stand
    between them.
    """

    half_angle: float = math.radians(12.0)
    nearest: Image = field(default_factory=lambda: np.full((1, 1), np.inf, dtype=np.float32))
    sight: float = 25.0
    reach: float = THINNEST / math.tan(2 * LIDAR_HALF_FAN / 15)

    @staticmethod
    def of(scan: LidarScan) -> RingView:
        ranges = np.where(scan.ranges > 0.0, scan.ranges, np.float32(np.inf))
        columns = len(ranges) // _COLUMNS * _COLUMNS
        blocks = ranges[:columns].reshape(-1, _COLUMNS, ranges.shape[1]).min(axis=1) if columns else ranges
        spacing = 2 * LIDAR_HALF_FAN / max(1, scan.header.beams - 1)
        return RingView(nearest=_least_around(blocks, wrap=True), reach=THINNEST / math.tan(spacing))

    def contains(self, place: Vector) -> bool:
        return abs(place[0]) <= max(_SLACK, math.sin(self.half_angle) * math.hypot(*place))

    def axis(self, heading: float, velocity: Points) -> Points | None:
        speed = math.hypot(velocity[0], velocity[1])
        if speed < _ON_THE_MOVE:
            return None
        direction = np.array([velocity[0] / speed, velocity[1] / speed, 0.0])
        out_of_plane = direction[0] * math.cos(heading) + direction[1] * math.sin(heading)
        return direction if abs(out_of_plane) <= math.sin(self.half_angle) else None

    def sees_through(self, places: Points) -> Mask:
        distance = np.maximum(np.linalg.norm(places, axis=1), 0.1)
        in_ring = np.flatnonzero(np.abs(places[:, 0]) <= math.sin(LIDAR_HALF_FAN) * distance)
        (fore, left, up), distance = places.T.take(in_ring, axis=1), distance.take(in_ring)
        columns, beams = self.nearest.shape
        turn = np.arctan2(up, left) / (2 * np.pi) % 1.0
        tilt = np.arcsin(np.clip(fore / distance, -1.0, 1.0)) / LIDAR_HALF_FAN
        beam = np.round(0.5 * (tilt + 1.0) * (beams - 1)).astype(np.int64)
        seen = np.where(np.isfinite(self.nearest), self.nearest, 0.0)
        seen = seen[(turn * columns).astype(np.int64) % columns, np.clip(beam, 0, beams - 1)]
        through = np.zeros(len(places), dtype=np.bool_)
        through[in_ring] = seen - 2 * _BEYOND > distance
        return through


def _cell(aside: Points, count: int) -> NDArray[np.int64]:
    """Row or column out of `count`: from -1 at the last one's far edge to 1 at the first one's."""
    return np.minimum((0.5 * count * (1.0 - aside)).astype(np.int64), count - 1)


_COLUMNS = 8
"""Number of neighbouring columns in a block of directions."""


def view_of(measurement: LidarScan | DepthPicture) -> SensorView:
    """The view of this measurement."""
    return CameraView.of(measurement) if isinstance(measurement, DepthPicture) else RingView.of(measurement)


def _least_around(image: Image, *, wrap: bool) -> Image:
    """The least of each value and its eight neighbours; rows are a circle if `wrap`."""
    least = image.copy()
    least[1:] = np.minimum(least[1:], image[:-1])
    least[:-1] = np.minimum(least[:-1], image[1:])
    if wrap:
        least[0] = np.minimum(least[0], image[-1])
        least[-1] = np.minimum(least[-1], image[0])
    rows = least.copy()
    least[:, 1:] = np.minimum(least[:, 1:], rows[:, :-1])
    least[:, :-1] = np.minimum(least[:, :-1], rows[:, 1:])
    return least
