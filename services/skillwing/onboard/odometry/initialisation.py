"""Initialisation of odometry: a first pose from navigation, and the IMU's biases from standing still."""

from __future__ import annotations

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
    G,
)
from skillwing.onboard.topics.navigation import Navigation

REST_TIME = 2.0
"""Time at rest before odometry begins [s]."""
SHORTEST = 0.5
"""Shortest stationary segment that gives the biases, if motion ends it early [s]."""
PATIENCE = 4.0
"""Time after which odometry begins even if the drone neither rests nor moves, but sways [s]."""
NAVIGATION_VALID = 0.2
_STILL_SPEED, _STILL_RATE, _STILL_FORCE = 0.15, 0.02, 0.25
"""Largest speed by navigation [m/s], and largest differences of an inertial batch's means from those of the segment
[rad/s, m/s2]: about eight standard deviations of the IMU's noise."""
_LARGEST_STEP = 0.1
_ANCHOR = 1e-4
"""Standard deviation of position [m] and attitude [rad], which define the frame."""
_TILT = 5e-3
"""Standard deviation of the frame's tilt, from the errors of navigation's roll and pitch [rad]."""
_REST_FORCE, _REST_RATE, _REST_SPEED = 0.01, 3e-4, 0.02
_MOVING_SPEED, _GYRO_BIAS, _ACCEL_BIAS = 0.1, 0.01, 0.06
"""Standard deviations without a stationary segment: velocity [m/s], and biases of an IMU after it was switched on
[rad/s, m/s2]."""


class StationarySegment:
    """Sums of measurements over a time without motion: `duration` [s]."""

    def __init__(self) -> None:
        self.duration = 0.0
        self._samples = self._solutions = 0
        self._force, self._rate = np.zeros(3), np.zeros(3)
        self._position, self._quaternion = np.zeros(3), np.zeros(4)

    @property
    def force(self) -> Floats:
        """Mean specific force (3,) [m/s2]."""
        return self._force / self._samples

    @property
    def rate(self) -> Floats:
        """Mean angular rate (3,) [rad/s]."""
        return self._rate / self._samples

    @property
    def has_pose(self) -> bool:
        return self._solutions > 0

    @property
    def position(self) -> Floats:
        """Mean position (3,) by navigation [m]."""
        return self._position / self._solutions

    @property
    def turn(self) -> Floats:
        """Mean attitude (3, 3) by navigation, body to world."""
        return so3.matrix(self._quaternion)

    def continues_with(self, batch: Inertial) -> bool:
        """Test for a batch of inertial samples that looks like the segment so far."""
        if not self._samples:
            return True
        rate, force = batch.rates.mean(axis=0) - self.rate, batch.forces.mean(axis=0) - self.force
        return bool(np.abs(rate).max() < _STILL_RATE and np.abs(force).max() < _STILL_FORCE)

    def add(self, batch: Inertial, duration: float) -> None:
        self.duration += duration
        self._samples += len(batch)
        self._force += batch.forces.sum(axis=0)
        self._rate += batch.rates.sum(axis=0)

    def add_pose(self, navigation: Navigation) -> None:
        quaternion = np.array(navigation.quaternion)
        self._solutions += 1
        self._position += navigation.position
        self._quaternion += quaternion if quaternion @ self._quaternion >= 0.0 else -quaternion


class Initialisation:
    """Initialisation from measurements, until odometry can begin.

    The world frame of odometry is navigation's ENU at that moment: position and heading come from there, once. On the
    ground they are means over the stationary segment. If the drone moves, odometry begins at once from
    navigation's pose and velocity. It takes the gyroscopes' biases of an earlier segment, if there was one.
    """

    def __init__(self) -> None:
        self._segment = StationarySegment()
        self._before: StationarySegment | None = None
        self._latest: Navigation | None = None
        self._latest_sample: float | None = None
        self._listening = 0.0

    def navigation(self, navigation: Navigation) -> None:
        """Take a navigation solution."""
        self._latest = navigation
        if _speed(navigation) < _STILL_SPEED:
            self._segment.add_pose(navigation)
        else:
            self._end_segment()

    def imu(self, batch: Inertial) -> None:
        """Take a batch of inertial samples."""
        heard, self._latest_sample = self._latest_sample, float(batch.times[-1])
        duration = 0.0 if heard is None else min(max(self._latest_sample - heard, 0.0), _LARGEST_STEP)
        self._listening += duration
        if not self._segment.continues_with(batch):
            self._end_segment()
        self._segment.add(batch, duration)

    def begin(self, t: float) -> tuple[FilterState, Floats] | None:
        """State and covariance (18, 18) of its error at `t`; None if it is too early, or navigation is silent."""
        latest = self._latest
        if latest is None or not latest.valid or abs(t - latest.t) > NAVIGATION_VALID or self._latest_sample is None:
            return None
        if self._segment.duration >= REST_TIME and self._segment.has_pose:
            return _at_rest(self._segment)
        if _speed(latest) >= _STILL_SPEED or self._before is not None or self._listening > PATIENCE:
            return _in_motion(latest, t, self._before)
        return None

    def _end_segment(self) -> None:
        if self._segment.duration >= SHORTEST:
            self._before = self._segment
        self._segment = StationarySegment()


def _speed(navigation: Navigation) -> float:
    return float(np.linalg.norm(navigation.velocity))


def _at_rest(rest: StationarySegment) -> tuple[FilterState, Floats]:
    state = FilterState(rest.position, rest.turn, np.zeros(3), rest.rate, np.zeros(3))
    covariance = _covariance(speed=_REST_SPEED, gyro_bias=_REST_RATE)
    return _level(state, covariance, rest.force)


def _in_motion(navigation: Navigation, t: float, before: StationarySegment | None) -> tuple[FilterState, Floats]:
    velocity = np.array(navigation.velocity)
    position = np.array(navigation.position) + (t - navigation.t) * velocity
    rate = before.rate if before else np.zeros(3)
    state = FilterState(position, so3.matrix(np.array(navigation.quaternion)), velocity, rate, np.zeros(3))
    return state, _covariance(speed=_MOVING_SPEED, gyro_bias=2.0 * _REST_RATE if before else _GYRO_BIAS)


def _covariance(*, speed: float, gyro_bias: float) -> Floats:
    sigmas = np.empty(SIZE)
    sigmas[POSITION] = sigmas[ATTITUDE] = _ANCHOR
    sigmas[VELOCITY], sigmas[GYRO_BIAS], sigmas[ACCEL_BIAS] = speed, gyro_bias, _ACCEL_BIAS
    sigmas[GRAVITY] = _TILT * G, _TILT * G, 1e-3
    return np.diag(sigmas**2)


def _level(state: FilterState, covariance: Floats, force: Floats) -> tuple[FilterState, Floats]:
    """Update with the mean force at rest, which is the reaction to gravity plus the accelerometers' bias.

    The two cannot be separated: a tilt of the frame by a milliradian looks like a bias of a centimetre per second
    squared. The Kalman update keeps this as a correlation, which movements and turns resolve later.
    """
    reaction = -state.turn.T @ state.gravity
    slopes = np.zeros((3, SIZE))
    slopes[:, GRAVITY], slopes[:, ACCEL_BIAS] = -state.turn.T, np.eye(3)
    spread = slopes @ covariance @ slopes.T + np.eye(3) * _REST_FORCE**2
    gain = np.linalg.solve(spread, slopes @ covariance).T
    leveled = state.plus(gain @ (force - reaction - state.accel_bias))
    remaining = (np.eye(SIZE) - gain @ slopes) @ covariance
    return leveled, 0.5 * (remaining + remaining.T)
