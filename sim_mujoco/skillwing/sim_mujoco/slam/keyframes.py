"""Poses from which the map was laid, whose errors the filter knows as it knows those of the drone.

A plane that was laid from a pose which was 0.2 m off lies wrong by as much. Compared with it, the drone learns how it
has moved since, and not where it is. A filter that takes its map for true confuses the two: it believes more with each
scan that its own wrong speed is right, because the map moves along, and when a wall at last shows how fast it really
flies, it has forgotten that its place depends on its speed. So the last of these poses stay in the filter as copies of
the drone's pose at the time (stochastic cloning: Roumeliotis and Burdick, "Stochastic cloning", 2002), as in the
sliding windows of visual odometry (Mourikis and Roumeliotis, 2007). What was laid before them is taken for true.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from skillwing.sim_mujoco.slam import so3
from skillwing.sim_mujoco.slam.so3 import Floats

MOST: Final = 10
"""Keyframes that are kept."""
STEP, TURN = 0.5, 0.3
"""A new one is made once the drone has moved [m] or turned [rad] so far since the last."""
LAYING: Final = np.array([1e-3] * 3 + [1e-4] * 3)
"""What errs between a keyframe and the planes that are laid from it [m, rad], for numbers' sake: an exact copy would
leave the covariance without an inverse."""
_SIZE = 6


@dataclass(frozen=True, slots=True)
class Keyframes:
    """The last poses from which the map was laid, oldest first.

    `places` (K, 3): where the drone was thought to be then, in the world frame [m]; `turn` (3, 3): its attitude at the
    last one, body to world; `shifts` (K, 6): by how much what was laid from there has to be moved and turned about that
    place to lie right, in world axes [m, rad]; `laid`: how many there have ever been.
    """

    places: Floats = field(default_factory=lambda: np.empty((0, 3)))
    turn: Floats = field(default_factory=lambda: np.eye(3))
    shifts: Floats = field(default_factory=lambda: np.empty((0, _SIZE)))
    laid: int = 0

    def __len__(self) -> int:
        return len(self.places)

    @property
    def newest(self) -> int:
        """The number of the last one, counted from 0 over all there have ever been."""
        return self.laid - 1

    def rows(self, numbers: NDArray[np.int64]) -> NDArray[np.int64]:
        """Where those of these numbers (N,) stand among the kept ones; -1 for those that are not kept any more."""
        return np.maximum(numbers - (self.laid - len(self)), -1)

    def is_due(self, position: Floats, turn: Floats) -> bool:
        """Whether the drone is so far from the last one that it needs another."""
        if not len(self):
            return True
        far = np.linalg.norm(position - self.places[-1]) > STEP
        return bool(far or np.linalg.norm(so3.log(self.turn.T @ turn)) > TURN)

    def with_one_more(self, position: Floats, turn: Floats, covariance: Floats, own: int) -> tuple[Keyframes, Floats]:
        """These and the present pose, without the oldest if there were enough; and the covariance of the errors.

        `own`: how many errors (of which the pose's are the first six) come before those of the keyframes.
        """
        dropped = 1 if len(self) == MOST else 0
        kept = _SIZE * (len(self) - dropped)
        change = np.zeros((own + kept + _SIZE, len(covariance)))
        change[:own, :own] = np.eye(own)
        change[own : own + kept, own + _SIZE * dropped :] = np.eye(kept)
        # Errors of the pose are along world axes in position, and along body axes in attitude.
        change[-_SIZE:-3, :3], change[-3:, 3:_SIZE] = np.eye(3), turn
        spread = change @ covariance @ change.T
        spread[-_SIZE:, -_SIZE:] += np.diag(LAYING**2)
        more = Keyframes(
            np.vstack([self.places[dropped:], position]),
            turn,
            np.vstack([self.shifts[dropped:], np.zeros(_SIZE)]),
            self.laid + 1,
        )
        return more, spread

    def seen_from(self, position: Floats, turn: Floats) -> Floats:
        """What shifts of the keyframes are for a drone at this pose: maps (K, 6, 6) to errors of its pose."""
        seen = np.zeros((len(self), _SIZE, _SIZE))
        seen[:, :3, :3], seen[:, 3:, 3:] = np.eye(3), turn.T
        for k, place in enumerate(self.places):
            seen[k, :3, 3:] = -so3.skew(position - place)
        return seen

    def plus(self, error: Floats) -> Keyframes:
        """The same with other shifts, by these errors (6 K,)."""
        return Keyframes(self.places, self.turn, self.shifts + error.reshape(-1, _SIZE), self.laid)

    def minus(self, other: Keyframes) -> Floats:
        """The errors (6 K,) by which these differ from others of the same poses."""
        return (self.shifts - other.shifts).ravel()
