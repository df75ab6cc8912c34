"""The navigation system: alignment, late fixes, false fixes, and navigation without fixes.

Call `inertial` with every sample, `epoch` every 0.1 s with the barometer's height, `fix` with each fix, and `odometry`
with each report of odometry.

A fix is compared with the state at the time of its measurement, and corrects the present state. It is accepted if it
lies within five sigma of inertial navigation, and if fixes have not jumped. For that, each fix is compared with the one
before and the speed in between, and jumps are summed up. So navigation does not accept a receiver that has jumped, even
when its own uncertainty has grown large enough. It accepts the receiver again after a jump back.

With fixes, odometry is only compared with navigation. Without fixes its velocity limits the drift of navigation's
(`odometry_aid.py`).
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from skillwing.onboard.frames.vectors import Quaternion, Vector, axes, heading_of, scale, to_world, wrap
from skillwing.sim_mujoco.navigation.error_filter import (
    ANGLES,
    BAROMETER,
    FORCE_BIAS,
    POSITION,
    RATE_BIAS,
    SIZE,
    VELOCITY,
    ErrorFilter,
    cross_matrix,
    nis,
)
from skillwing.sim_mujoco.navigation.odometry_aid import GATED, WEIGHED, OdometryReport, Reputation
from skillwing.sim_mujoco.navigation.strapdown import ZERO, Strapdown
from skillwing.sim_mujoco.sensors.instruments import BAROMETER_NOISE, IMU_PERIOD
from skillwing.sim_mujoco.sensors.receivers import ReceiverClass
from skillwing.sim_mujoco.sensors.self_tests import NOT_FINITE

EPOCH = 0.1
"""Period of aiding measurements, and of the stored states [s]."""
_SNAPSHOTS = 5
_ALIGNMENT = 25
"""Least number of samples at rest to average before the first fix is used; at most ten times as many."""
_GATE = 25.0
"""Largest NIS of an accepted fix: five sigma."""
_REJECTIONS = 10
"""Number of rejected fixes in a row that is reported against the receiver."""
_SILENCE = 1.0
"""Gap between fixes above which a jump cannot be distinguished from motion [s]."""
_STILL, _STILL_RATE = 0.03, 0.002
"""Standard deviations of the motion of a drone on the ground: [m/s], [rad/s]."""
_DRIFTING = 0.2
"""Largest uncertainty of a velocity that allows holding a position and a soft touchdown [m/s]."""
_FIXED = 0.5
"""Time after a used fix during which navigation counts as fixed [s]."""
_COLOURED = 2.0
"""Factor on the noise of fixes, whose errors change too slowly to be averaged out."""


@dataclass(frozen=True, slots=True)
class Solution:
    """The navigation solution at `t`; fields as in `Motion`.

    `sigma` and `height_sigma` [m] are its own estimates of the position's uncertainty. While not `valid` the position
    is dead reckoning; attitude and rate are still good. While `velocity_valid`, as odometry can make it, the drone can
    hold its position.
    """

    t: float
    position: Vector
    velocity: Vector
    quaternion: Quaternion
    rate: Vector
    valid: bool = True
    sigma: float = 0.0
    height_sigma: float = 0.0
    velocity_valid: bool = True


@dataclass(slots=True)
class _Snapshot:
    """A stored state: the expected fix at `t`, as position, velocity, heading (7,), and the attitude."""

    t: float
    expected: NDArray[np.float64]
    quaternion: Quaternion


class FixSteps:
    """Detector of jumps: compares the steps between a receiver's fixes with its own velocity."""

    def __init__(self, receiver: ReceiverClass) -> None:
        self._jitter = 10.0 * receiver.jitter
        self._last: tuple[float, NDArray[np.float32]] | None = None
        self._jumps = np.zeros(3)

    @property
    def jumped(self) -> bool:
        """The jumps since the last reset add up to more than jitter."""
        return float(np.linalg.norm(self._jumps)) > self._limit(EPOCH)

    def reset(self) -> None:
        """Accept the receiver's position as it is now."""
        self._jumps = np.zeros(3)

    def take(self, t: float, fix: NDArray[np.float32]) -> bool:
        """Compare with the fix before. False if it is the same fix again."""
        last, self._last = self._last, (t, fix)
        if last is None:
            return True
        before, previous = last
        if np.array_equal(previous, fix):
            self._last = last
            return False
        if t - before > _SILENCE:
            self.reset()
            return True
        step = fix[:3] - previous[:3] - 0.5 * (t - before) * (fix[3:6] + previous[3:6])
        if np.linalg.norm(step) > self._limit(t - before):
            self._jumps += step
        return True

    def _limit(self, dt: float) -> float:
        """Largest step error within `dt` that jitter and velocity noise explain [m]."""
        return self._jitter + 0.5 * dt


class Navigator:
    """Navigation of one drone with one class of satellite receiver."""

    def __init__(self, receiver: ReceiverClass) -> None:
        level, height = _COLOURED * receiver.level, _COLOURED * receiver.height
        self._noise = np.array([level, level, height, *[receiver.speed] * 3, receiver.heading])
        self._receiver = receiver
        self._samples: deque[tuple[float, ...]] = deque(maxlen=10 * _ALIGNMENT)
        self._state: Strapdown | None = None
        self._filter = self._new_filter()
        self._sigma = math.inf
        self._pressure_offset = 0.0
        self._snapshots: deque[_Snapshot] = deque(maxlen=_SNAPSHOTS)
        self._steps = FixSteps(receiver)
        self._rejected = 0
        self._fixed_at = -math.inf
        self._odometry_at = -math.inf
        self._reputation = Reputation()
        self._standing = True

    @property
    def aligned(self) -> bool:
        """Position and attitude have been found, which takes a moment at rest and a fix."""
        return self._state is not None

    @property
    def attitude(self) -> tuple[Quaternion, Vector]:
        """Estimated attitude and angular rate (FLU) now; level before alignment."""
        state = self._state
        return ((1.0, 0.0, 0.0, 0.0), ZERO) if state is None else (state.quaternion, state.rate)

    def solution(self, t: float) -> Solution | None:
        """The solution at `t`, the time of the latest sample; None before alignment."""
        state = self._state
        if state is None:
            return None
        return Solution(
            t,
            state.position,
            state.velocity,
            state.quaternion,
            state.rate,
            self._is_valid,
            self._sigma,
            math.hypot(self._filter.sigma(POSITION)[2], self._receiver.height),
            self._velocity_is_valid,
        )

    def inertial(self, force: Vector, rate: Vector) -> None:
        """Take specific force [m/s2] and angular rate [rad/s], FLU, of the last 4 ms."""
        if self._state is not None:
            self._state.step(force, rate, IMU_PERIOD)
        else:
            self._samples.append((*force, *rate))

    def epoch(self, t: float, pressure_height: float, *, standing: bool) -> None:
        """Take the barometer's height [m] of an epoch, and zero motion if the drone is `standing`."""
        self._standing = standing
        state = self._state
        if state is None:
            return
        self._filter.predict(EPOCH, np.array(state.impulse), np.transpose(axes(state.quaternion)))
        self._take_height(state, pressure_height)
        if standing:
            self._take_rest(state)
        state.impulse = state.turn = ZERO
        # The filter cannot see the common drift of the fixes. Unlike max, np.max returns NaN if there is one.
        self._sigma = math.hypot(float(np.max(self._filter.sigma(POSITION)[:2])), self._receiver.level)
        expected = np.array([*state.position, *state.velocity, heading_of(state.quaternion)])
        self._snapshots.append(_Snapshot(t, expected, state.quaternion))

    def fix(self, now: float, t: float, fix: NDArray[np.float32], *, usable: bool) -> str | None:
        """Take a fix (7,) measured at `t`, and return what its history shows against the receiver, in words.

        It is used if it is plausible, and `usable` in the opinion of others. The first one ends alignment.
        """
        if not np.isfinite(fix).all():
            return NOT_FINITE  # It would stay in alignment and filter for ever.
        if not self._steps.take(t, fix):
            return None  # The receiver repeats an old fix.
        if self._state is None:
            if usable and len(self._samples) >= _ALIGNMENT:
                self._align(fix)
        elif self._standing and not self._is_valid:
            self._state = None  # On the ground alignment may start again, with any fix.
        else:
            return self._weigh(self._state, now, t, fix, usable=usable)
        return None

    def odometry(self, report: OdometryReport) -> None:
        """Take a velocity of odometry. It is too late if the state of its time is no longer stored."""
        state, snapshot = self._state, self._remembered(report.t)
        if state is None or snapshot is None or report.t <= self._odometry_at:
            return
        self._odometry_at = report.t
        self._reputation.reported_by(report.since)
        if report.good and not self._standing:
            self._weigh_velocity(state, snapshot, report)

    def place(self, position: Vector, heading: float) -> None:
        """Set the state of a drone at rest: for tests."""
        state = self._state
        quaternion = (math.cos(heading / 2), 0.0, 0.0, math.sin(heading / 2))
        biases = (state.force_bias, state.rate_bias) if state is not None else (ZERO, ZERO)
        self._begin(Strapdown(position, ZERO, quaternion, *biases))

    # --- alignment -------------------------------------------------------------------------------------------

    def _align(self, fix: NDArray[np.float32]) -> None:
        """Align a drone at rest: tilt from gravity, gyroscope biases from the rate, the rest from the fix."""
        x, y, z, turn_x, turn_y, turn_z = np.mean(np.array(self._samples), axis=0).tolist()
        length = math.sqrt(x * x + y * y + z * z)
        up_x, up_y, up_z = x / length, y / length, z / length
        upright = math.sqrt(0.5 * (1.0 + up_z))
        a, b = 0.5 * up_y / upright, -0.5 * up_x / upright
        heading = float(fix[6])
        c, s = math.cos(heading / 2), math.sin(heading / 2)
        quaternion = (c * upright, c * a - s * b, c * b + s * a, s * upright)
        position = (float(fix[0]), float(fix[1]), float(fix[2]))
        self._begin(Strapdown(position, ZERO, quaternion, ZERO, (turn_x, turn_y, turn_z)))

    def _begin(self, state: Strapdown) -> None:
        self._state, self._filter = state, self._new_filter()
        self._sigma = float(self._noise[0])
        self._rejected = 0
        self._steps.reset()
        self._snapshots.clear()
        self._samples.clear()

    def _new_filter(self) -> ErrorFilter:
        return ErrorFilter(self._noise[0], self._noise[2], self._noise[6])

    # --- measurements ----------------------------------------------------------------------------------------

    def _take_height(self, state: Strapdown, height: float) -> None:
        design = np.zeros((1, SIZE))
        design[0, POSITION.start + 2] = design[0, BAROMETER] = 1.0
        residual = np.array([height - state.position[2] - self._pressure_offset])
        self._correct(state, self._filter.update(residual, design, np.array([BAROMETER_NOISE**2])))

    def _take_rest(self, state: Strapdown) -> None:
        design = np.zeros((6, SIZE))
        design[:3, VELOCITY] = design[3:, RATE_BIAS] = np.eye(3)
        residual = np.array([*scale(-1.0, state.velocity), *scale(1.0 / EPOCH, state.turn)])
        noise = np.array([_STILL**2] * 3 + [_STILL_RATE**2] * 3)
        self._correct(state, self._filter.update(residual, design, noise))

    def _weigh(self, state: Strapdown, now: float, t: float, fix: NDArray[np.float32], *, usable: bool) -> str | None:
        compared = self._compare(t, fix, now - t)
        if compared is None:
            return None
        residual, design = compared
        if not self._steps.jumped and self._likely(residual, design):
            self._rejected = 0
            if usable:
                self._fixed_at = t
                self._correct(state, self._filter.update(residual, design, self._noise**2))
            return None
        self._rejected += 1
        if self._rejected < _REJECTIONS:
            return None
        return f"its fixes are {np.linalg.norm(residual[:3]):.1f} m from where inertial navigation is"

    def _compare(
        self, t: float, fix: NDArray[np.float32], delay: float
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
        """Residual (7,) of a fix and its design matrix (7, 16); None if the state of its time is not stored."""
        snapshot = self._remembered(t)
        if snapshot is None:
            return None
        residual = fix - snapshot.expected
        residual[6] = wrap(residual[6])
        design = np.zeros((7, SIZE))
        design[:3, POSITION] = design[3:6, VELOCITY] = np.eye(3)
        design[:3, VELOCITY] = -delay * np.eye(3)
        design[6, ANGLES.start + 2] = 1.0
        return residual, design

    def _weigh_velocity(self, state: Strapdown, snapshot: _Snapshot, report: OdometryReport) -> None:
        velocity = np.array(to_world(snapshot.quaternion, report.velocity))
        residual = velocity - snapshot.expected[3:6]
        design = np.zeros((3, SIZE))
        design[:, VELOCITY] = np.eye(3)
        # The attitude that turns body axes into the world may be wrong.
        design[:, ANGLES] = cross_matrix(velocity)
        spread = design @ self._filter.covariance @ design.T + GATED**2 * np.eye(3)
        agrees, fixed = nis(residual, spread) <= _GATE, snapshot.t - self._fixed_at <= _FIXED
        self._reputation.observe(agrees=agrees, fixed=fixed)
        # Navigation that has drifted is so uncertain that almost any velocity would agree with it.
        if agrees and not fixed and self._reputation.earned and self._velocity_is_valid:
            self._correct(state, self._filter.update(residual, design, np.full(3, WEIGHED**2)))

    def _remembered(self, t: float) -> _Snapshot | None:
        return next((snapshot for snapshot in self._snapshots if abs(snapshot.t - t) < 1e-6), None)

    def _likely(self, residual: NDArray[np.float64], design: NDArray[np.float64]) -> bool:
        spread = design @ self._filter.covariance @ design.T + np.diag(self._noise**2)
        return all(nis(residual[k], spread[k, k]) <= _GATE for k in (slice(0, 3), slice(3, 6)))

    def _correct(self, state: Strapdown, errors: NDArray[np.float64]) -> None:
        def part(which: slice) -> Vector:
            x, y, z = errors[which].tolist()
            return x, y, z

        state.correct(*(part(which) for which in (POSITION, VELOCITY, ANGLES, FORCE_BIAS, RATE_BIAS)))
        self._pressure_offset += float(errors[BAROMETER])
        for snapshot in self._snapshots:
            snapshot.expected[:6] += errors[:6]
            snapshot.expected[6] += errors[ANGLES.start + 2]

    @property
    def _is_valid(self) -> bool:
        return self._sigma <= self._receiver.trusted

    @property
    def _velocity_is_valid(self) -> bool:
        return all(sigma <= _DRIFTING for sigma in self._filter.sigma(VELOCITY))
