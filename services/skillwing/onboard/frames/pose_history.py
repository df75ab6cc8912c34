"""Poses of the last second, interpolated for sensors whose measurements take time."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from skillwing.onboard.frames.vectors import Motion
from skillwing.onboard.topics.navigation import Navigation

SPAN = 1.0
"""Length of the history [s]."""
_GAP = 0.1
"""Longest gap between two poses to interpolate in [s]."""


class PoseHistory:
    """History of navigation solutions. A solution older than the latest one clears it first: time was reset."""

    def __init__(self) -> None:
        self._track: deque[Motion] = deque()

    @property
    def latest(self) -> float | None:
        """Time of the latest pose."""
        return self._track[-1].t if self._track else None

    def add(self, navigation: Navigation) -> None:
        track = self._track
        if track and not 0.0 <= navigation.t - track[-1].t <= _GAP:
            track.clear()
        w, x, y, z = navigation.quaternion
        if track and sum(a * b for a, b in zip(track[-1].quaternion, (w, x, y, z), strict=True)) < 0.0:
            w, x, y, z = -w, -x, -y, -z
        track.append(
            Motion(navigation.t, navigation.position, navigation.velocity, (w, x, y, z), navigation.angular_velocity)
        )
        while track[-1].t - track[0].t > SPAN:
            track.popleft()

    def covers(self, start: float, end: float) -> bool:
        """Test for a history that spans all of `start` to `end`."""
        return bool(self._track) and self._track[0].t <= start and end <= self._track[-1].t

    def at(self, times: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Positions (N, 3) [m] and rotations body to world (N, 3, 3) at `times` (N,), which must be covered."""
        positions, quaternions = interpolate(self._track, times)
        return positions, rotations(quaternions)


def interpolate(track: Sequence[Motion], times: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Positions (N, 3) and unit quaternions (N, 4) at `times` (N,), linear between the samples of a dense track.

    Samples 10 ms apart turn by less than a degree, where normalised linear interpolation of quaternions is exact
    enough. Consecutive quaternions must lie on the same hemisphere, as those of an integrator do.
    """
    # Kept as rows of one component each, which the next steps take them apart into again.
    at, *components = np.array([(m.t, *m.position, *m.quaternion) for m in track]).T
    poses = np.stack([np.interp(times, at, component) for component in components])
    positions, quaternions = poses[:3], poses[3:]
    return positions.T, (quaternions / np.linalg.norm(quaternions, axis=0)).T


def rotations(quaternions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rotation matrices (N, 3, 3), body to world, of unit quaternions (N, 4) as (w, x, y, z)."""
    w, x, y, z = quaternions.T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.array(rows).transpose(2, 0, 1)
