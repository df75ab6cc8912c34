"""A point-mass drone with limits of speed and acceleration, and with its own failsafes.

Pure: call `advance` and read its state. Frames are ENU, metres and seconds; the ground is flat, at height 0.
"""

from __future__ import annotations

import math
from enum import StrEnum

from skillwing.onboard.topics.common import Vector3
from skillwing.onboard.topics.flight import AutopilotSetpoint

MAX_SPEED, MAX_ACCELERATION = 8.0, 4.0
POSITION_GAIN, VELOCITY_GAIN = 1.0, 4.0
"""Gains from position error to velocity, and from velocity error to acceleration [1/s]: critically damped."""
SETPOINT_TIMEOUT, LAND_AFTER = 0.5, 5.0
"""Age at which setpoints expire, and further time until it lands [s]."""
LANDING_SPEED = 0.7
TOUCHDOWN = 0.3
"""Time of contact with the ground that counts as landed [s]."""
CRITICAL_CHARGE = 8.0
CONSUMPTION = 0.05
"""Battery consumption in the air [% / s]."""


class Mode(StrEnum):
    """The flight mode. The values of autonomous modes are published as the failsafe."""

    OFF = "rotors off"
    FOLLOW = "following setpoints"
    PILOT = "safety pilot flies"
    HOLD = "no setpoints: holding position"
    LAND = "no setpoints: landing"
    BATTERY = "battery critical: landing"


class Vehicle:
    """A point mass that stands at the origin at time `t`.

    Attributes to set: `authority`, the switch of its safety pilot; `charge` of the battery [%].
    """

    def __init__(self, t: float = 0.0) -> None:
        self.position: Vector3 = (0.0, 0.0, 0.0)
        self.velocity: Vector3 = (0.0, 0.0, 0.0)
        self.heading = 0.0
        self.authority = True
        self.charge = 100.0
        self.mode = Mode.OFF
        self._t = t
        self._setpoint: AutopilotSetpoint | None = None
        self._stamp = -math.inf
        self._held: Vector3 = self.position
        self._pressed_since: float | None = None

    @property
    def on_ground(self) -> bool:
        """True if it stands with its rotors off."""
        return self.mode is Mode.OFF

    @property
    def failsafe(self) -> str:
        """The autonomous mode; empty if there is none."""
        return self.mode if self.mode in (Mode.HOLD, Mode.LAND, Mode.BATTERY) else ""

    def command(self, setpoint: AutopilotSetpoint, t: float) -> None:
        """A setpoint at `t`. One older than the last is ignored."""
        stamp = min(setpoint.t, t)
        if stamp >= self._stamp and t - stamp <= SETPOINT_TIMEOUT:
            self._setpoint, self._stamp = setpoint, stamp

    def advance(self, t: float) -> None:
        """Advance the vehicle to `t`."""
        dt, self._t = t - self._t, t
        self._enter(self._choose(t - self._stamp))
        if self.mode is Mode.OFF or dt <= 0.0:
            return
        self.charge = max(0.0, self.charge - CONSUMPTION * dt)
        place, velocity, acceleration = self._wanted(dt)
        self._move(dt, place, velocity, acceleration)
        if self._has_landed(t, place):
            self._enter(Mode.OFF)

    # --- what to do --------------------------------------------------------------------------------------------------

    def _choose(self, age: float) -> Mode:
        fresh, setpoint = age <= SETPOINT_TIMEOUT, self._setpoint
        if self.mode is Mode.OFF:
            rises = setpoint is not None and setpoint.rotors and setpoint.position[2] > self.position[2] + 0.05
            ready = fresh and rises and self.authority and self.charge > CRITICAL_CHARGE
            return Mode.FOLLOW if ready else Mode.OFF
        if self.charge <= CRITICAL_CHARGE:
            return Mode.BATTERY
        if not self.authority:
            return Mode.PILOT
        if fresh:
            return Mode.FOLLOW
        return Mode.LAND if age > SETPOINT_TIMEOUT + LAND_AFTER else Mode.HOLD

    def _enter(self, mode: Mode) -> None:
        if mode is not self.mode:
            self.mode, self._held, self._pressed_since = mode, self.position, None
        if mode is Mode.OFF:
            self.velocity = (0.0, 0.0, 0.0)

    def _wanted(self, dt: float) -> tuple[Vector3, Vector3, Vector3]:
        """Setpoints of position, velocity and acceleration."""
        if self.mode is Mode.FOLLOW and self._setpoint is not None:
            self.heading = self._setpoint.heading
            return self._setpoint.position, self._setpoint.velocity, self._setpoint.acceleration
        sink = LANDING_SPEED if self.mode in (Mode.LAND, Mode.BATTERY) else 0.0
        x, y, z = self._held
        self._held = x, y, z - sink * dt
        return self._held, (0.0, 0.0, -sink), (0.0, 0.0, 0.0)

    # --- how it moves ------------------------------------------------------------------------------------------------

    def _move(self, dt: float, place: Vector3, velocity: Vector3, acceleration: Vector3) -> None:
        towards = _limited(_sum(velocity, _times(POSITION_GAIN, _less(place, self.position))), MAX_SPEED)
        push = _limited(_sum(acceleration, _times(VELOCITY_GAIN, _less(towards, self.velocity))), MAX_ACCELERATION)
        self.velocity = _limited(_sum(self.velocity, _times(dt, push)), MAX_SPEED)
        x, y, z = _sum(self.position, _times(dt, self.velocity))
        if z < 0.0:
            z, self.velocity = 0.0, (0.0, 0.0, 0.0)
        self.position = x, y, z

    def _has_landed(self, t: float, place: Vector3) -> bool:
        if self.position[2] > 0.0 or place[2] >= 0.0:
            self._pressed_since = None
        elif self._pressed_since is None:
            self._pressed_since = t
        return self._pressed_since is not None and t - self._pressed_since >= TOUCHDOWN


def _sum(a: Vector3, b: Vector3) -> Vector3:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def _less(a: Vector3, b: Vector3) -> Vector3:
    return _sum(a, _times(-1.0, b))


def _times(factor: float, a: Vector3) -> Vector3:
    return factor * a[0], factor * a[1], factor * a[2]


def _limited(a: Vector3, length: float) -> Vector3:
    return _times(min(1.0, length / max(math.hypot(*a), 1e-9)), a)
