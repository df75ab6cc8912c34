"""State of the filter, and the addition and subtraction of small errors.

Errors are vectors of 18: position [m], attitude [rad], velocity [m/s], bias of the gyroscopes [rad/s], bias of the
accelerometers [m/s2], gravity [m/s2]; and of six more for each of K keyframes. Gravity is a part of the state, as in
FAST-LIO (Xu and Zhang, 2021): the first pose, which may be tilted by some tenths of a degree, fixes the frame for the
whole map. An attitude error is a small rotation in body axes, after the estimated attitude.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from skillwing.onboard.odometry import so3
from skillwing.onboard.odometry.keyframes import Keyframes
from skillwing.onboard.odometry.so3 import Floats

POSITION: Final = slice(0, 3)
ATTITUDE: Final = slice(3, 6)
POSE: Final = slice(0, 6)
VELOCITY: Final = slice(6, 9)
GYRO_BIAS: Final = slice(9, 12)
ACCEL_BIAS: Final = slice(12, 15)
GRAVITY: Final = slice(15, 18)
SIZE: Final = 18
"""Number of errors without those of the keyframes, which come after them."""
G: Final = 9.81
"""Strength of gravity [m/s2]."""


@dataclass(frozen=True, slots=True)
class FilterState:
    """Position, velocity and `gravity` (3,) in the world frame, `turn` (3, 3) from body to world, biases (3,) in body
    axes."""

    position: Floats
    turn: Floats
    velocity: Floats
    gyro_bias: Floats
    accel_bias: Floats
    gravity: Floats = field(default_factory=lambda: np.array([0.0, 0.0, -G]))
    keyframes: Keyframes = field(default_factory=Keyframes)

    def to_world(self, point: Floats) -> Floats:
        """A point (3,) in body axes, in the world frame."""
        return self.position + self.turn @ point

    def placed(self, points: Floats | NDArray[np.float32]) -> Floats:
        """Points (N, 3) in body axes, in the world frame. They lie in memory axis by axis, which is faster."""
        return (self.turn @ points.T + self.position[:, None]).T

    def levelled(self, origin: Floats) -> FilterState:
        """The state in a frame turned about `origin` (3,) so that its z axis is up, by the estimate of gravity; without
        keyframes, because the planes are not turned."""
        turn = so3.between(self.gravity, np.array([0.0, 0.0, -1.0]))
        return replace(
            self,
            position=origin + turn @ (self.position - origin),
            turn=turn @ self.turn,
            velocity=turn @ self.velocity,
            gravity=turn @ self.gravity,
            keyframes=Keyframes(),
        )

    def poses_from_keyframes(self) -> Floats:
        """Derivatives (1 + K, 6, 18 + 6 K) of the drone's pose relative to planes, by errors of this state: for planes
        mapped before all K kept keyframes, and for those of each."""
        keyframes, own = self.keyframes, np.zeros((1 + self.keyframes.kept, 6, SIZE))
        own[:, :, POSE] = np.eye(6)
        theirs, kept = np.zeros((len(own), 6, keyframes.kept, 6)), np.arange(keyframes.kept)
        theirs[1 + kept, :, kept] = -keyframes.seen_from(self.position, self.turn, keyframes.oldest + kept)
        return np.concatenate([own, theirs.reshape(len(own), 6, -1)], axis=2)

    def plus(self, error: Floats) -> FilterState:
        """The state that differs by this error (18 + 6 K,) from this one."""
        return FilterState(
            self.position + error[POSITION],
            self.turn @ so3.exp(error[ATTITUDE]),
            self.velocity + error[VELOCITY],
            self.gyro_bias + error[GYRO_BIAS],
            self.accel_bias + error[ACCEL_BIAS],
            self.gravity + error[GRAVITY],
            self.keyframes.plus(error[SIZE:]),
        )

    def minus(self, other: FilterState) -> Floats:
        """The error (18 + 6 K,) by which this state differs from the other; `other.plus` of it is this one."""
        return np.concatenate(
            [
                self.position - other.position,
                so3.log(other.turn.T @ self.turn),
                self.velocity - other.velocity,
                self.gyro_bias - other.gyro_bias,
                self.accel_bias - other.accel_bias,
                self.gravity - other.gravity,
                self.keyframes.minus(other.keyframes),
            ]
        )
