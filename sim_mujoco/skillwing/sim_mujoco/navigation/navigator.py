"""The navigation system: alignment, fixes that come late, fixes that lie, and what is left without them.

Call `inertial` with every sample, `epoch` every 0.1 s with the barometer's height, `fix` with each fix, `odometry` with
what odometry says, if there is one.

A fix is compared with where the drone was when it was measured, and corrects where it is now. It is believed if it
lies within five sigma of inertial navigation, and if fixes have not jumped: each is compared with the one before and
the speed meanwhile, and what they jump by is summed up. So a receiver that jumps is not believed later, when
navigation without it has become so uncertain that its fixes could be true; but it is when it has jumped back.

While there are fixes, odometry only proves itself. Without them its velocity keeps the drone's from drifting, and the
position drifts as odometry does instead of faster and faster (`odometry_aid.py`).
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
    surprise,
)
from skillwing.sim_mujoco.navigation.odometry_aid import GATED, WEIGHED, OdometryReport, Reputation
from skillwing.sim_mujoco.navigation.strapdown import ZERO, Strapdown
from skillwing.sim_mujoco.sensors.instruments import BAROMETER_NOISE, IMU_PERIOD
from skillwing.sim_mujoco.sensors.receivers import Receiver
from skillwing.sim_mujoco.sensors.self_tests import NOT_FINITE

EPOCH = 0.1
"""Between two aiding measurements, and between two records of the past [s]."""
_PAST = 5
_ALIGNMENT = 25
"""So many samples at rest are averaged at least before the first fix is used; ten times as many at most."""
_GATE = 25.0
"""Squared Mahalanobis distance of a fix that is believed: five sigma."""
_DOUBTFUL = 10
"""So many disbelieved fixes in a row accuse the receiver."""
_SILENCE = 1.0
"""Over a longer silence jumps cannot be told from motion [s]."""
_STILL, _STILL_RATE = 0.03, 0.002
"""How still a drone stands on the ground: [m/s], [rad/s]."""
_DRIFTING = 0.2
"""Velocities with more than this uncertainty are no use for holding a place, or for setting down softly [m/s]."""
_FIXED = 0.5
"""So long after a fix that was used there are fixes [s]."""
_COLOURED = 2.0
"""Position errors of a receiver change slowly, so that averaging its fixes helps little: they count so much noisier."""


@dataclass(frozen=True, slots=True)
class Solution:
    """Where the navigation system says the drone is at `t`; fields as in `Motion`.

    `sigma` and `height_sigma` [m] are how uncertain it is of the position, by its own account. While not `valid` it is
    too uncertain to say where the drone is: position and velocity are dead reckoning; attitude and rate are still good.
    While it still vouches for the velocity (`velocity_valid`), as odometry can make it, the drone can hold its place.
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
class _Past:
    """What a fix measured at `t` should have been: position, velocity, heading (7,); and the attitude then."""

    t: float
    expected: NDArray[np.float64]
    quaternion: Quaternion


class FixSteps:
    """Whether a receiver's fixes follow one another as its own speed says, or have jumped away."""

    def __init__(self, receiver: Receiver) -> None:
        self._jitter = 10.0 * receiver.jitter
        self._last: tuple[float, NDArray[np.float32]] | None = None
        self._jumps = np.zeros(3)

    @property
    def jumped(self) -> bool:
        """Whether the jumps since fixes were last believed add up to more than jitter."""
        return float(np.linalg.norm(self._jumps)) > self._limit(EPOCH)

    def forget(self) -> None:
        """Believe the receiver as it is now."""
        self._jumps = np.zeros(3)

    def take(self, t: float, fix: NDArray[np.float32]) -> bool:
        """Compare with the fix before; False if it is the same one again."""
        last, self._last = self._last, (t, fix)
        if last is None:
            return True
        before, previous = last
        if np.array_equal(previous, fix):
            self._last = last
            return False
        if t - before > _SILENCE:
            self.forget()
            return True
        step = fix[:3] - previous[:3] - 0.5 * (t - before) * (fix[3:6] + previous[3:6])
        if np.linalg.norm(step) > self._limit(t - before):
            self._jumps += step
        return True

    def _limit(self, dt: float) -> float:
        """How far fixes may be off within `dt`: by jitter, and by the speed between them [m]."""
        return self._jitter + 0.5 * dt


class Navigator:
    """One drone's navigation with this class of satellite receiver."""

    def __init__(self, receiver: Receiver) -> None:
        level, height = _COLOURED * receiver.level, _COLOURED * receiver.height
        self._noise = np.array([level, level, height, *[receiver.speed] * 3, receiver.heading])
        self._receiver = receiver
        self._samples: deque[tuple[float, ...]] = deque(maxlen=10 * _ALIGNMENT)
        self._state: Strapdown | None = None
        self._filter = self._new_filter()
        self._sigma = math.inf
        self._pressure_offset = 0.0
        self._past: deque[_Past] = deque(maxlen=_PAST)
        self._steps = FixSteps(receiver)
        self._disbelieved = 0
        self._fixed_at = -math.inf
        self._odometry_at = -math.inf
        self._reputation = Reputation()
        self._standing = True

    @property
    def aligned(self) -> bool:
        """Whether place and attitude have been found: it takes a moment at rest, and a fix."""
        return self._state is not None

    @property
    def attitude(self) -> tuple[Quaternion, Vector]:
        """Attitude and angular rate (FLU) now, as good as there are; level before alignment."""
        state = self._state
        return ((1.0, 0.0, 0.0, 0.0), ZERO) if state is None else (state.quaternion, state.rate)

    def solution(self, t: float) -> Solution | None:
        """Where the drone is at `t`, the time of the latest sample; None before alignment."""
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
            self._vouches_for_velocity,
        )

    def inertial(self, force: Vector, rate: Vector) -> None:
        """Specific force [m/s2] and angular rate [rad/s], FLU, of the last 4 ms."""
        if self._state is not None:
            self._state.step(force, rate, IMU_PERIOD)
        else:
            self._samples.append((*force, *rate))

    def epoch(self, t: float, pressure_height: float, *, standing: bool) -> None:
        """A tenth of a second is over: take the barometer's height [m], and stillness if the drone is `standing`."""
        self._standing = standing
        state = self._state
        if state is None:
            return
        self._filter.predict(EPOCH, np.array(state.impulse), np.transpose(axes(state.quaternion)))
        self._take_height(state, pressure_height)
        if standing:
            self._take_rest(state)
        state.impulse = state.turn = ZERO
        # What the receiver's fixes wander together the filter cannot see. Unlike max, np.max overlooks no NaN.
        self._sigma = math.hypot(float(np.max(self._filter.sigma(POSITION)[:2])), self._receiver.level)
        expected = np.array([*state.position, *state.velocity, heading_of(state.quaternion)])
        self._past.append(_Past(t, expected, state.quaternion))

    def fix(self, now: float, t: float, fix: NDArray[np.float32], *, usable: bool) -> str | None:
        """Take a fix (7,) measured at `t`; what speaks against a receiver that gave it, after what it gave before.

        It is used unless it cannot be true, or is not `usable` for reasons of others. The first one ends alignment.
        """
        if not np.isfinite(fix).all():
            return NOT_FINITE  # Neither alignment nor the filter would ever get rid of it.
        if not self._steps.take(t, fix):
            return None  # Nothing new was measured.
        if self._state is None:
            if usable and len(self._samples) >= _ALIGNMENT:
                self._align(fix)
        elif self._standing and not self._is_valid:
            self._state = None  # On the ground one may begin anew, and believe whatever there is.
        else:
            return self._weigh(self._state, now, t, fix, usable=usable)
        return None

    def odometry(self, report: OdometryReport) -> None:
        """Take odometry's word for the velocity. One of a moment that is no longer remembered comes too late."""
        state, past = self._state, self._remembered(report.t)
        if state is None or past is None or report.t <= self._odometry_at:
            return
        self._odometry_at = report.t
        self._reputation.meet(report.since)
        if report.good and not self._standing:
            self._weigh_velocity(state, past, report)

    def place(self, position: Vector, heading: float) -> None:
        """Know suddenly that the drone is at rest somewhere: for tests."""
        state = self._state
        quaternion = (math.cos(heading / 2), 0.0, 0.0, math.sin(heading / 2))
        biases = (state.force_bias, state.rate_bias) if state is not None else (ZERO, ZERO)
        self._begin(Strapdown(position, ZERO, quaternion, *biases))

    # --- beginning -------------------------------------------------------------------------------------------

    def _align(self, fix: NDArray[np.float32]) -> None:
        """Gravity tells the tilt of a drone at rest, its receiver the rest; gyroscopes should read zero."""
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
        self._disbelieved = 0
        self._steps.forget()
        self._past.clear()
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
            self._disbelieved = 0
            if usable:
                self._fixed_at = t
                self._correct(state, self._filter.update(residual, design, self._noise**2))
            return None
        self._disbelieved += 1
        if self._disbelieved < _DOUBTFUL:
            return None
        return f"its fixes are {np.linalg.norm(residual[:3]):.1f} m from where inertial navigation is"

    def _compare(
        self, t: float, fix: NDArray[np.float32], delay: float
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
        """Residual (7,) of a fix and how today's errors show in it (7, 16); None if the past is not known."""
        past = self._remembered(t)
        if past is None:
            return None
        residual = fix - past.expected
        residual[6] = wrap(residual[6])
        design = np.zeros((7, SIZE))
        design[:3, POSITION] = design[3:6, VELOCITY] = np.eye(3)
        design[:3, VELOCITY] = -delay * np.eye(3)
        design[6, ANGLES.start + 2] = 1.0
        return residual, design

    def _weigh_velocity(self, state: Strapdown, past: _Past, report: OdometryReport) -> None:
        velocity = np.array(to_world(past.quaternion, report.velocity))
        residual = velocity - past.expected[3:6]
        design = np.zeros((3, SIZE))
        design[:, VELOCITY] = np.eye(3)
        # Body axes are turned into the world by an attitude that may be wrong.
        design[:, ANGLES] = cross_matrix(velocity)
        spread = design @ self._filter.covariance @ design.T + GATED**2 * np.eye(3)
        agrees, fixed = surprise(residual, spread) <= _GATE, past.t - self._fixed_at <= _FIXED
        self._reputation.observe(agrees=agrees, fixed=fixed)
        # Once navigation has drifted, almost anything would agree with it.
        if agrees and not fixed and self._reputation.earned and self._vouches_for_velocity:
            self._correct(state, self._filter.update(residual, design, np.full(3, WEIGHED**2)))

    def _remembered(self, t: float) -> _Past | None:
        return next((past for past in self._past if abs(past.t - t) < 1e-6), None)

    def _likely(self, residual: NDArray[np.float64], design: NDArray[np.float64]) -> bool:
        spread = design @ self._filter.covariance @ design.T + np.diag(self._noise**2)
        return all(surprise(residual[k], spread[k, k]) <= _GATE for k in (slice(0, 3), slice(3, 6)))

    def _correct(self, state: Strapdown, errors: NDArray[np.float64]) -> None:
        def part(which: slice) -> Vector:
            x, y, z = errors[which].tolist()
            return x, y, z

        state.correct(*(part(which) for which in (POSITION, VELOCITY, ANGLES, FORCE_BIAS, RATE_BIAS)))
        self._pressure_offset += float(errors[BAROMETER])
        for past in self._past:
            past.expected[:6] += errors[:6]
            past.expected[6] += errors[ANGLES.start + 2]

    @property
    def _is_valid(self) -> bool:
        return self._sigma <= self._receiver.trusted

    @property
    def _vouches_for_velocity(self) -> bool:
        return all(sigma <= _DRIFTING for sigma in self._filter.sigma(VELOCITY))
