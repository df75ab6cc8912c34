"""Where the drone was during the last second, for sensors whose measurements take time."""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray

from skillwing.onboard.frames.motion import Motion
from skillwing.onboard.frames.poses import interpolate, rotations
from skillwing.onboard.topics.navigation import Navigation

SPAN = 1.0
"""How long poses are remembered [s]."""
_GAP = 0.1
"""Between poses further apart than this nothing is interpolated [s]."""


class PoseHistory:
    """The latest navigation solutions. One that is older than the latest begins a new history: time was reset."""

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
        """Whether the drone's pose is known at every moment from `start` to `end`."""
        return bool(self._track) and self._track[0].t <= start and end <= self._track[-1].t

    def at(self, times: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Positions (N, 3) [m] and rotations body to world (N, 3, 3) at `times` (N,), which must be covered."""
        positions, quaternions = interpolate(self._track, times)
        return positions, rotations(quaternions)
