"""Poses from which the map was laid, whose errors the filter knows as it knows those of the drone.

A plane that was laid from a pose which was 0.2 m off lies wrong by as much. Compared with it, the drone learns how it
has moved since, and not where it is. A filter that takes its map for true confuses the two: it believes more with each
scan that its own wrong speed is right, because the map moves along, and when a wall at last shows how fast it really
flies, it has forgotten that its place depends on its speed. So the last of these poses stay in the filter as copies of
the drone's pose at the time (stochastic cloning: Roumeliotis and Burdick, "Stochastic cloning", 2002), as in the
sliding windows of visual odometry (Mourikis and Roumeliotis, 2007). What was laid before them is taken for true where
it was last known to be.
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
"""A new one is made once the drone has moved [m] or turned [rad] so far since the last."""
LAYING: Final = np.array([1e-3] * 3 + [1e-4] * 3)
"""What errs between a keyframe and the planes that are laid from it [m, rad], for numbers' sake: an exact copy would
leave the covariance without an inverse."""
_SIZE = 6


@dataclass(frozen=True, slots=True)
class Keyframes:
    """All L poses from which the map was laid, oldest first. Of the last `kept` the errors are in the filter.

    `places` (L, 3): where the drone was thought to be then, in the world frame [m]; `turn` (3, 3): its attitude at the
    last one, body to world; `shifts` (L, 6): by how much what was laid from there has to be moved and turned about that
    place to lie right, in world axes [m, rad].
    """

    places: Floats = field(default_factory=lambda: np.empty((0, 3)))
    turn: Floats = field(default_factory=lambda: np.eye(3))
    shifts: Floats = field(default_factory=lambda: np.empty((0, _SIZE)))

    @property
    def kept(self) -> int:
        """Of how many the errors are in the filter."""
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
        """Whether the drone is so far from the last one that it needs another."""
        if self.newest < 0:
            return True
        far = np.linalg.norm(position - self.places[-1]) > STEP
        return bool(far or np.linalg.norm(so3.log(self.turn.T @ turn)) > TURN)

    def with_one_more(self, position: Floats, turn: Floats, covariance: Floats) -> tuple[Keyframes, Floats]:
        """These and the present pose; and the covariance of the errors, without those of the oldest if there were
        enough. The first six errors are those of the pose, the last those of keyframes."""
        own = len(covariance) - _SIZE * self.kept
        dropped = 1 if self.kept == MOST else 0
        left = _SIZE * (self.kept - dropped)
        change = np.zeros((own + left + _SIZE, len(covariance)))
        change[:own, :own] = np.eye(own)
        change[own : own + left, own + _SIZE * dropped :] = np.eye(left)
        # Errors of the pose are along world axes in position, and along body axes in attitude.
        change[-_SIZE:-3, :3], change[-3:, 3:_SIZE] = np.eye(3), turn
        spread = change @ covariance @ change.T
        spread[-_SIZE:, -_SIZE:] += np.diag(LAYING**2)
        shifts = np.vstack([self.shifts, np.zeros(_SIZE)])
        return Keyframes(np.vstack([self.places, position]), turn, shifts), spread

    def seen_from(self, position: Floats, turn: Floats, numbers: NDArray[np.int64]) -> Floats:
        """What shifts of these keyframes (N,) are for a drone at this pose: maps (N, 6, 6) to errors of its pose."""
        seen = np.zeros((len(numbers), _SIZE, _SIZE))
        seen[:, :3, :3], seen[:, 3:, 3:] = np.eye(3), turn.T
        seen[:, :3, 3:] = -so3.skew(position - self.places[numbers])
        return seen

    def laid(self, points: Floats) -> Floats:
        """Where points (N, 3) in the world frame have to be laid so that the shift of the newest brings them there."""
        shift, place = self.shifts[-1], self.places[-1]
        return place + (points - shift[:3] - place) @ so3.exp(shift[3:])

    def plus(self, error: Floats) -> Keyframes:
        """The same with other shifts of those that are kept, by these errors (6 K,)."""
        shifts = self.shifts.copy()
        shifts[self.oldest :] += error.reshape(-1, _SIZE)
        return Keyframes(self.places, self.turn, shifts)

    def minus(self, other: Keyframes) -> Floats:
        """The errors (6 K,) by which those that are kept differ from others of the same poses."""
        return (self.shifts - other.shifts)[self.oldest :].ravel()
