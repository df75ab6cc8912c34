"""Keyframes: poses that planes were mapped from, whose errors are in the filter's state.

A plane mapped from a pose with an error of 0.2 m has the same error. It shows the drone's movement since, not its
position. A filter that takes its map for exact confuses the two. With each scan it becomes more certain of a wrong
speed, because the map moves along. When a wall shows the true speed at last, the correlation of position and speed is
lost. So the filter keeps the last of these poses as copies of the drone's pose at the time (stochastic cloning:
Roumeliotis and Burdick, "Stochastic cloning", 2002), as in the sliding windows of visual odometry (Mourikis and
Roumeliotis, 2007). It takes planes mapped before them for exact, at their last estimate.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from skillwing.onboard.odometry import so3
from skillwing.onboard.odometry.so3 import Floats

MOST: Final = 10
"""Keyframes whose errors are in the filter."""
STEP, TURN = 0.5, 0.3
"""Movement [m] or turn [rad] since the last keyframe after which the next one is due."""
MAPPING_SIGMA: Final = np.array([1e-3] * 3 + [1e-4] * 3)
"""Standard deviations between a keyframe and its planes [m, rad], for numerical stability: with an exact copy the
covariance has no inverse."""
_SIZE = 6


@dataclass(frozen=True, slots=True)
class Keyframes:
    """All L poses that the map was made from, oldest first. The errors of the last `kept` are in the filter.

    `places` (L, 3): estimated positions of the drone then, in the world frame [m]. `turn` (3, 3): its attitude at the
    last one, body to world. `shifts` (L, 6): corrections of the planes mapped from there, a movement and a turn about
    that place, in world axes [m, rad].
    """

    places: Floats = field(default_factory=lambda: np.empty((0, 3)))
    turn: Floats = field(default_factory=lambda: np.eye(3))
    shifts: Floats = field(default_factory=lambda: np.empty((0, _SIZE)))

    @property
    def kept(self) -> int:
        """Number of keyframes whose errors are in the filter."""
        return min(len(self.places), MOST)

    @property
    def newest(self) -> int:
        """The number of the last one, counted from 0."""
        return len(self.places) - 1

    @property
    def oldest(self) -> int:
        """The number of the first one whose errors are in the filter."""
        return len(self.places) - self.kept

    def is_due(self, position: Floats, turn: Floats) -> bool:
        """Test for a pose so far from the last keyframe that another one is due."""
        if self.newest < 0:
            return True
        far = np.linalg.norm(position - self.places[-1]) > STEP
        return bool(far or np.linalg.norm(so3.log(self.turn.T @ turn)) > TURN)

    def with_one_more(self, position: Floats, turn: Floats, covariance: Floats) -> tuple[Keyframes, Floats]:
        """These and the present pose; and the covariance of the errors, without those of the oldest one if there are
        enough. The first six errors are those of the pose, the last ones those of keyframes."""
        own = len(covariance) - _SIZE * self.kept
        dropped = 1 if self.kept == MOST else 0
        left = _SIZE * (self.kept - dropped)
        change = np.zeros((own + left + _SIZE, len(covariance)))
        change[:own, :own] = np.eye(own)
        change[own : own + left, own + _SIZE * dropped :] = np.eye(left)
        # Errors of the pose are along world axes in position, and along body axes in attitude.
        change[-_SIZE:-3, :3], change[-3:, 3:_SIZE] = np.eye(3), turn
        spread = change @ covariance @ change.T
        spread[-_SIZE:, -_SIZE:] += np.diag(MAPPING_SIGMA**2)
        shifts = np.vstack([self.shifts, np.zeros(_SIZE)])
        return Keyframes(np.vstack([self.places, position]), turn, shifts), spread

    def seen_from(self, position: Floats, turn: Floats, numbers: NDArray[np.int64]) -> Floats:
        """Matrices (N, 6, 6) from shifts of these keyframes (N,) to errors of a drone's pose."""
        seen = np.zeros((len(numbers), _SIZE, _SIZE))
        seen[:, :3, :3], seen[:, 3:, 3:] = np.eye(3), turn.T
        seen[:, :3, 3:] = -so3.skew(position - self.places[numbers])
        return seen

    def mapped(self, points: Floats) -> Floats:
        """Positions at which to map points (N, 3) in the world frame, so that the newest shift brings them there."""
        shift, place = self.shifts[-1], self.places[-1]
        return place + (points - shift[:3] - place) @ so3.exp(shift[3:])

    def plus(self, error: Floats) -> Keyframes:
        """The same keyframes with these errors (6 K,) added to the kept shifts."""
        shifts = self.shifts.copy()
        shifts[self.oldest :] += error.reshape(-1, _SIZE)
        return Keyframes(self.places, self.turn, shifts)

    def minus(self, other: Keyframes) -> Floats:
        """The errors (6 K,) between the kept shifts and others of the same poses."""
        return (self.shifts - other.shifts)[self.oldest :].ravel()
