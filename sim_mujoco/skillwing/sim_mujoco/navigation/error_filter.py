"""The error-state Kalman filter of inertial navigation, with the attitude error in the world frame.

See J. Sola, "Quaternion kinematics for the error-state Kalman filter" (2017), chapter 7, and P. Groves, "Principles of
GNSS, Inertial, and Multisensor Integrated Navigation Systems" (2013), chapter 14. Errors are added to the nominal state
at each update, so they are zero in between. Only their covariance is kept.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from skillwing.sim_mujoco.sensors.instruments import BAROMETER_DRIFT, IMU_NOISE, IMU_PERIOD, IMU_TURN_ON, IMU_WALK

Matrix = NDArray[np.float64]

POSITION, VELOCITY, ANGLES, FORCE_BIAS, RATE_BIAS = (slice(3 * k, 3 * k + 3) for k in range(5))
BAROMETER: Final = 15
SIZE: Final = 16
"""Errors: position, velocity, small rotation about the world's axes, biases (FLU), offset of the barometer."""
_SHAKEN = 2.0
"""Factor on the noise of the inertial sensors' model, because sampling aliases impacts."""
_TILT = 0.01
"""Uncertainty of the initial tilt, which follows from gravity and accelerometer biases [rad]."""


class ErrorFilter:
    """The covariance of the errors."""

    def __init__(self, level: float, height: float, heading: float) -> None:
        """The filter of a drone at rest, with uncertainties of level position [m], height [m] and heading [rad]."""
        sigma = np.zeros(SIZE)
        sigma[POSITION], sigma[VELOCITY] = (level, level, height), 0.05
        sigma[ANGLES] = _TILT, _TILT, heading
        sigma[FORCE_BIAS], sigma[RATE_BIAS] = IMU_TURN_ON[:3], IMU_TURN_ON[3:]
        sigma[BAROMETER] = 10.0
        self._set(np.diag(sigma**2))
        self._transition = np.eye(SIZE)
        growth = np.zeros(SIZE)
        growth[VELOCITY] = (_SHAKEN * IMU_NOISE[:3]) ** 2 * IMU_PERIOD
        growth[ANGLES] = (_SHAKEN * IMU_NOISE[3:]) ** 2 * IMU_PERIOD
        growth[FORCE_BIAS], growth[RATE_BIAS] = IMU_WALK[:3] ** 2, IMU_WALK[3:] ** 2
        growth[BAROMETER] = BAROMETER_DRIFT**2
        self._growth = np.diag(growth)

    def predict(self, dt: float, impulse: Matrix, turn: Matrix) -> None:
        """Propagate over `dt`. impulse: integral of the specific force in the world frame (3,) [m/s]. turn: rotation
        from body to world (3, 3)."""
        transition, lever = self._transition, cross_matrix(impulse)
        transition[POSITION, VELOCITY] = dt * np.eye(3)
        transition[POSITION, ANGLES] = -0.5 * dt * lever
        transition[VELOCITY, ANGLES] = -lever
        transition[POSITION, FORCE_BIAS] = -0.5 * dt * dt * turn
        transition[VELOCITY, FORCE_BIAS] = transition[ANGLES, RATE_BIAS] = -dt * turn
        self._set(transition @ self.covariance @ transition.T + dt * self._growth)

    def update(self, residual: Matrix, design: Matrix, noise: Matrix) -> Matrix:
        """The errors (16,) that explain a residual (n,), given its design matrix (n, 16) and variances (n,)."""
        cross = self.covariance @ design.T
        spread = design @ cross + np.diag(noise)
        gain = np.linalg.solve(spread, cross.T).T
        reduced = self.covariance - gain @ cross.T
        self._set(0.5 * (reduced + reduced.T))
        return gain @ residual

    def sigma(self, errors: slice) -> list[float]:
        """Standard deviations of some of the errors."""
        return self._sigma[errors]

    def _set(self, covariance: Matrix) -> None:
        self.covariance = covariance
        # They are read more often than they change.
        self._sigma: list[float] = np.sqrt(np.diagonal(covariance)).tolist()


def nis(residual: Matrix, spread: Matrix) -> float:
    """Normalised innovation squared (NIS) of a residual (n,) with covariance (n, n)."""
    return float(residual @ np.linalg.solve(spread, residual))


def cross_matrix(v: Matrix) -> Matrix:
    """The matrix (3, 3) that makes the cross product v x u of a vector u."""
    x, y, z = v
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
