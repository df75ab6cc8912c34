"""The low-level autopilot: follows setpoints, and looks after the drone by itself when they stop coming.

No fresh setpoint for 0.5 s: it brakes and holds position. For 5 s more: it lands at 0.7 m/s. While the safety pilot
has the authority it holds position and ignores setpoints. Rotors stop by themselves on touchdown.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from skillwing.sim_mujoco.frames.vectors import Quaternion, Vector, add, heading_of, norm, scale
from skillwing.sim_mujoco.sensors.instruments import RANGE_MOUNT
from skillwing.sim_mujoco.simulator.cascade import AttitudeLoop, VelocityLoop, position_to_velocity
from skillwing.sim_mujoco.simulator.hexacopter import GEAR_HEIGHT, ROTORS, Airframe

SETPOINT_TIMEOUT = 0.5
LAND_AFTER = 5.0
LANDING_SPEED = 0.7
_STANDING_RANGE = GEAR_HEIGHT + RANGE_MOUNT[2]
_BRAKING_TIME = 0.6
_TOUCHDOWN_TIME, _BLIND_TOUCHDOWN_TIME = 0.4, 1.5


class Mode(StrEnum):
    """What the autopilot is doing. The values of the failsafe modes are what it tells others."""

    OFF = "rotors off"
    FOLLOW = "following setpoints"
    PILOT = "safety pilot flies"
    HOVER = "no setpoints: holding position"
    LAND = "no setpoints: landing"


@dataclass(frozen=True, slots=True)
class Setpoint:
    """Where to be, with velocity and acceleration feed-forward, and where to point, in ENU."""

    position: Vector
    velocity: Vector
    heading: float
    rotors: bool = True
    acceleration: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Estimate:
    """What the autopilot knows of its motion; `ground` is the range-finder's distance [m], None if it sees none."""

    position: Vector
    velocity: Vector
    quaternion: Quaternion
    ground: float | None


class Autopilot:
    """Call `guide` every 20 ms and `stabilise` at every physics step of `dt` seconds."""

    def __init__(self, airframe: Airframe, dt: float) -> None:
        self._velocity_loop = VelocityLoop()
        self._attitude_loop = AttitudeLoop(airframe, dt)
        self._setpoint: Setpoint | None = None
        self._received = float("-inf")
        self._hold = Setpoint((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0)
        self._landing_since: float | None = None
        self._guided: float | None = None
        self.mode = Mode.OFF
        self.authority = True

    @property
    def on_ground(self) -> bool:
        return self.mode is Mode.OFF

    @property
    def failsafe(self) -> str:
        """What the autopilot does by itself, in words; empty while it follows or stands."""
        return self.mode.value if self.mode in (Mode.HOVER, Mode.LAND) else ""

    def command(self, setpoint: Setpoint, t: float) -> None:
        """A setpoint arrived at time `t`."""
        self._setpoint, self._received = setpoint, t

    def guide(self, t: float, now: Estimate) -> None:
        """Choose the mode and the wanted attitude for the next 20 ms."""
        dt = 0.02 if self._guided is None else t - self._guided
        self._guided = t
        self._choose_mode(t, now)
        if self.mode is Mode.OFF:
            return
        target = self._target(dt)
        velocity = position_to_velocity(now.position, target.position, target.velocity)
        acceleration = self._velocity_loop.acceleration(now.velocity, velocity, target.acceleration, dt)
        self._attitude_loop.aim(acceleration, target.heading, now.quaternion)
        if self._has_touched_down(t, now, target):
            self._enter(Mode.OFF, now)

    def stabilise(self, quaternion: Quaternion, rate: Vector) -> list[float]:
        """Rotor thrusts (6) [N]."""
        if self.mode is Mode.OFF:
            return [0.0] * ROTORS
        return self._attitude_loop.thrusts(quaternion, rate)

    def _choose_mode(self, t: float, now: Estimate) -> None:
        age = t - self._received
        if self.mode is Mode.OFF:
            if self.authority and age <= SETPOINT_TIMEOUT and self._asks_to_rise(now):
                self._enter(Mode.FOLLOW, now)
        elif not self.authority:
            self._enter(Mode.PILOT, now)
        elif age <= SETPOINT_TIMEOUT:
            self._enter(Mode.FOLLOW, now)
        elif self.mode is Mode.PILOT:
            self._received = t - SETPOINT_TIMEOUT
            self._enter(Mode.HOVER, now)
        elif age > SETPOINT_TIMEOUT + LAND_AFTER:
            self._enter(Mode.LAND, now)
        else:
            self._enter(Mode.HOVER, now)

    def _asks_to_rise(self, now: Estimate) -> bool:
        wanted = self._setpoint
        return wanted is not None and wanted.rotors and wanted.position[2] > now.position[2] + 0.05

    def _enter(self, mode: Mode, now: Estimate) -> None:
        if mode is self.mode:
            return
        if self.mode is Mode.OFF:
            self._velocity_loop.reset()
            self._attitude_loop.reset()
        if mode in (Mode.HOVER, Mode.PILOT):
            stop = add(now.position, scale(_BRAKING_TIME, now.velocity))
            self._hold = Setpoint(stop, (0.0, 0.0, 0.0), heading_of(now.quaternion))
        self._landing_since = None
        self.mode = mode

    def _target(self, dt: float) -> Setpoint:
        if self.mode is Mode.FOLLOW and self._setpoint is not None:
            return self._setpoint
        if self.mode is Mode.LAND:
            sink = (0.0, 0.0, -LANDING_SPEED)
            self._hold = Setpoint(add(self._hold.position, scale(dt, sink)), sink, self._hold.heading)
        return self._hold

    def _has_touched_down(self, t: float, now: Estimate, target: Setpoint) -> bool:
        """Told to sink, at rest, and the range-finder sees the ground at the skids; without it, at rest for longer."""
        sinking = target.position[2] < now.position[2] - 0.05 or target.velocity[2] < -0.05 or not target.rotors
        standing = now.ground is not None and now.ground < _STANDING_RANGE + 0.08
        if not sinking or norm(now.velocity) > 0.25 or (now.ground is not None and not standing):
            self._landing_since = None
            return False
        if self._landing_since is None:
            self._landing_since = t
        return t - self._landing_since >= (_TOUCHDOWN_TIME if standing else _BLIND_TOUCHDOWN_TIME)
