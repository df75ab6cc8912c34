"""Deskewing: correction of a scan for the drone's motion, to the time of its end."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from skillwing.onboard.odometry.propagation import Track
from skillwing.onboard.odometry.so3 import Floats
from skillwing.onboard.sensor_data.directions import lidar_directions
from skillwing.onboard.sensor_data.scans import OWN_BODY, LidarScan

_HASH_BITS = 17
_FACTORS = np.array([2654435761, 2246822519, 3266489917], dtype=np.uint32)
"""Large odd numbers: the upper bits of their multiples are spread evenly (Knuth, section 6.4)."""


@dataclass(frozen=True, slots=True)
class StillScan:
    """Returns (N, 3) in body axes at the end of the scan [m], and their `ranges` (N,) as measured [m].

    `sensor` (3,) is the sensor's position in the middle of the scan.

    Points lie in memory axis by axis, because arrays of threes are slow to compute with.
    """

    points: NDArray[np.float32]
    ranges: NDArray[np.float32]
    sensor: Floats

    def within(self, reach: float) -> NDArray[np.float32]:
        """The points whose ranges were at most `reach` [m]."""
        return self.points.T.take(np.flatnonzero(self.ranges <= reach), axis=1).T


def deskew(scan: LidarScan, track: Track, reach: float) -> StillScan:
    """Move each column to its pose of measurement, relative to the end of the track, which must cover the scan.

    Between two samples of the track, some milliseconds apart, poses are interpolated linearly. Returns from farther
    than `reach` [m] and from the drone itself are left out.
    """
    header = scan.header
    within = (scan.ranges > 0.0) & (scan.ranges <= reach)
    columns = np.flatnonzero(within.any(axis=1))  # the others look into the sky
    # The last time is the middle of the scan.
    times = header.t0 + np.append((columns + 0.5) / header.columns, 0.5) * (header.t1 - header.t0)
    before = np.clip(np.searchsorted(track.times, times, side="right") - 1, 0, len(track.times) - 2)
    share = (times - track.times[before]) / (track.times[before + 1] - track.times[before])
    last_turn, last_position = track.turns[-1], track.positions[-1]
    relative = last_turn.T @ track.turns
    offsets = (track.positions - last_position) @ last_turn
    turns = relative[before] + share[:, None, None] * (relative[before + 1] - relative[before])
    places = offsets[before] + share[:, None] * (offsets[before + 1] - offsets[before])
    mount = np.array(header.mount)
    ranges = scan.ranges.take(columns, axis=0)
    in_body = _rays(header.columns, header.beams).take(columns, axis=1) * ranges
    in_body += mount[:, None, None].astype(np.float32)
    kept = within.take(columns, axis=0)
    kept &= np.einsum("ijk,ijk->jk", in_body, in_body) > OWN_BODY**2
    numbers = np.flatnonzero(kept)
    points = np.empty((3, len(numbers)), dtype=np.float32)
    for axis in range(3):
        row = turns[:-1, axis].T.astype(np.float32)[:, :, None]
        moved = row[0] * in_body[0] + row[1] * in_body[1] + row[2] * in_body[2]
        moved += places[:-1, axis, None].astype(np.float32)
        points[axis] = moved.ravel().take(numbers)
    return StillScan(points.T, ranges.ravel().take(numbers), places[-1] + turns[-1] @ mount)


def thinned(points: NDArray[np.float32], cell: float) -> NDArray[np.float32]:
    """Points thinned to at most one of (N, 3) in each cube of side `cell` [m].

    Cubes are identified by a hash of their indices. Of two cubes with the same hash one loses its point, without harm.
    """
    across = np.ascontiguousarray(points.T)
    cells = np.floor(across * np.float32(1.0 / cell)).astype(np.int32).view(np.uint32)
    x, y, z = _FACTORS
    hashes = (cells[0] * x + cells[1] * y + cells[2] * z) >> np.uint32(32 - _HASH_BITS)
    owners = np.empty(1 << _HASH_BITS, dtype=np.int32)
    numbers = np.arange(len(points), dtype=np.int32)
    owners[hashes] = numbers
    return across.take(np.flatnonzero(owners.take(hashes) == numbers), axis=1).T


@lru_cache(maxsize=2)
def _rays(columns: int, beams: int) -> NDArray[np.float32]:
    """Directions (3, columns, beams) in body axes."""
    return np.ascontiguousarray(lidar_directions(columns, beams).transpose(2, 0, 1), dtype=np.float32)
