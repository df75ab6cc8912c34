"""Propagation by inertial measurements: the path, the state at its end, and its covariance.

Strap-down integration and the transition of the error state as in Sola, "Quaternion kinematics for the error-state
Kalman filter" (2017), sections 5.4 and 5.5.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from skillwing.onboard.odometry import so3
from skillwing.onboard.odometry.inertial import Inertial
from skillwing.onboard.odometry.so3 import Floats
from skillwing.onboard.odometry.state import (
    ACCEL_BIAS,
    ATTITUDE,
    GRAVITY,
    GYRO_BIAS,
    POSITION,
    SIZE,
    VELOCITY,
    FilterState,
)

_STRIDE = 13
"""Samples of one step of the covariance: 52 ms, in which its inputs hardly change."""


@dataclass(frozen=True, slots=True)
class ImuNoise:
    """Noise densities of an IMU: white noise of gyroscopes [rad/s/sqrt(Hz)] and accelerometers [m/s2/sqrt(Hz)], and
    random walk of their biases [rad/s/sqrt(s), m/s2/sqrt(s)]."""

    gyro: float = 4e-4
    accel: float = 5e-3
    gyro_walk: float = 2e-4
    accel_walk: float = 2e-3

    def growth(self, duration: float) -> Floats:
        """Variances (18,) added to the errors in `duration` seconds."""
        variances = np.zeros(SIZE)
        for part, density in (
            (ATTITUDE, self.gyro),
            (VELOCITY, self.accel),
            (GYRO_BIAS, self.gyro_walk),
            (ACCEL_BIAS, self.accel_walk),
        ):
            variances[part] = density**2 * duration
        return variances


@dataclass(frozen=True, slots=True)
class Track:
    """Poses along a path: `times` (N,), `positions` (N, 3) in the world frame, `turns` (N, 3, 3) from body to world."""

    times: Floats
    positions: Floats
    turns: Floats


@dataclass(frozen=True, slots=True)
class Prediction:
    """The path by inertial measurements, the state at its end, and the covariance (N, N) of its error."""

    track: Track
    state: FilterState
    covariance: Floats


def predict(
    state: FilterState, covariance: Floats, measured: Inertial, start: float, end: float, noise: ImuNoise
) -> Prediction:
    """Propagate `state` at `start` by the measurements to `end`. There must be at least one.

    The previous sample stands in for a missing one.
    """
    times = np.concatenate([[start], measured.times[1:], [end]])
    steps = np.diff(times)
    rates, forces = measured.rates - state.gyro_bias, measured.forces - state.accel_bias
    turns = _chained(state.turn, so3.exp(_between(rates) * steps[:, None]))
    # Specific force is turned by the attitude in the middle of each step.
    halfway = turns[:-1] @ so3.exp(rates * (0.5 * steps)[:, None])
    accelerations = np.einsum("nij,nj->ni", halfway, _between(forces)) + state.gravity
    velocities = np.vstack([state.velocity, state.velocity + np.cumsum(accelerations * steps[:, None], axis=0)])
    moves = 0.5 * (velocities[:-1] + velocities[1:]) * steps[:, None]
    positions = np.vstack([state.position, state.position + np.cumsum(moves, axis=0)])
    for first in range(0, len(steps), _STRIDE):
        last = min(first + _STRIDE, len(steps))
        duration = float(times[last] - times[first])
        mean_force, mean_rate = forces[first:last].mean(axis=0), rates[first:last].mean(axis=0)
        step = _transition(turns[first], mean_force, mean_rate, duration)
        covariance = _moved_on(covariance, step)
        covariance[np.diag_indices(SIZE)] += noise.growth(duration)
    end_state = replace(state, position=positions[-1], turn=turns[-1], velocity=velocities[-1])
    return Prediction(Track(times, positions, turns), end_state, covariance)


def _moved_on(covariance: Floats, step: Floats) -> Floats:
    """The covariance after this step (18, 18) of the drone's own errors; errors of keyframes stay the same."""
    moved = covariance.copy()
    moved[:SIZE] = step @ moved[:SIZE]
    moved[:, :SIZE] = moved[:, :SIZE] @ step.T
    return moved


def _between(samples: Floats) -> Floats:
    """Means of neighbouring samples, for the time between them; the last sample stands for itself."""
    return np.vstack([0.5 * (samples[:-1] + samples[1:]), samples[-1:]])


def _chained(first: Floats, increments: Floats) -> Floats:
    turns = np.empty((len(increments) + 1, 3, 3))
    turns[0] = first
    for k, increment in enumerate(increments):
        turns[k + 1] = turns[k] @ increment
    return turns


def _transition(turn: Floats, force: Floats, rate: Floats, duration: float) -> Floats:
    """Transition matrix (18, 18) of the drone's own error over `duration`."""
    step = np.eye(SIZE)
    identity = np.eye(3)
    by_attitude = -turn @ so3.skew(force)
    step[POSITION, VELOCITY] = identity * duration
    step[POSITION, ATTITUDE] = by_attitude * (0.5 * duration**2)
    step[POSITION, ACCEL_BIAS] = -turn * (0.5 * duration**2)
    step[POSITION, GRAVITY] = identity * (0.5 * duration**2)
    step[ATTITUDE, ATTITUDE] = so3.exp(-rate * duration)
    step[ATTITUDE, GYRO_BIAS] = -identity * duration
    step[VELOCITY, ATTITUDE] = by_attitude * duration
    step[VELOCITY, ACCEL_BIAS] = -turn * duration
    step[VELOCITY, GRAVITY] = identity * duration
    return step
