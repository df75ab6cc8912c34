"""The low-level autopilot: it follows setpoints, and protects the drone when it cannot follow them any more.

`failsafes.py` lists the reasons for that, in order of priority. Before a landing the autopilot brakes; it stays inside
the fence. With a lost rotor it no longer controls the heading. With lost navigation it holds its position as long as
the velocity is valid. Without a valid velocity it descends fast: it controls the estimated velocity, and the vertical
speed that the range-finder measures. Rotors stop on touchdown.
"""

from __future__ import annotations

from dataclasses import dataclass

from skillwing.onboard.frames.vectors import Quaternion, Vector, add, heading_of, scale
from skillwing.onboard.guidance.limits import HOLD_TIME, SETPOINT_TIMEOUT
from skillwing.sim_mujoco.autopilot.cascade import AttitudeLoop, VelocityLoop, position_to_velocity
from skillwing.sim_mujoco.autopilot.descent import STANDING_RANGE, Estimate, GroundSpeed, Touchdown, sink_speed
from skillwing.sim_mujoco.autopilot.failsafes import (
    LANDING,
    OVERRULING,
    Emergencies,
    FailsafeLimits,
    Mode,
)
from skillwing.sim_mujoco.autopilot.fence_guard import FenceGuard
from skillwing.sim_mujoco.autopilot.rotor_watch import RotorWatch
from skillwing.sim_mujoco.physics.hexacopter import ROTORS, Airframe

__all__ = ["Autopilot", "Estimate", "FailsafeLimits", "Mode", "Setpoint"]

GUIDE_PERIOD = 0.02
"""Period of `guide` [s]."""
_BRAKING_TIME = 0.6
_STANDS_ABOVE = 0.7
"""A drone that is so far above its target and at rest stands on something [m]."""
_NEAR_GROUND = 0.3
"""Clearance below the skids within which contacts, and not only rotors, may turn the drone [m]."""
_DOWNWARD = -0.05
"""A commanded climb below this is a descent [m/s]."""
_SINKING = 0.7
"""Share of the commanded descent that a drone in the air with a lost rotor exceeds."""


@dataclass(frozen=True, slots=True)
class Setpoint:
    """Position and heading to reach, with velocity and acceleration feed-forward, in ENU."""

    position: Vector
    velocity: Vector
    heading: float
    rotors: bool = True
    acceleration: Vector = (0.0, 0.0, 0.0)


class Autopilot:
    """The autopilot of one drone. Call `guide` every 20 ms and `stabilise` every `dt` seconds."""

    def __init__(self, airframe: Airframe, dt: float, limits: FailsafeLimits | None = None) -> None:
        limits = limits or FailsafeLimits()
        self._velocity_loop = VelocityLoop()
        self._attitude_loop = AttitudeLoop(airframe, dt)
        self._emergencies = Emergencies(limits)
        self._fence = FenceGuard(limits.fence) if limits.fence is not None else None
        self._rotors = RotorWatch(airframe)
        self._ground_speed, self._touchdown = GroundSpeed(), Touchdown()
        self._setpoint: Setpoint | None = None
        self._stamp = float("-inf")
        self._hold = Setpoint((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0)
        self._guided: float | None = None
        self._commanded_climb = 0.0
        self._wall: str | None = None
        self.mode = Mode.OFF
        self.authority = True

    @property
    def on_ground(self) -> bool:
        return self.mode is Mode.OFF

    @property
    def failsafe(self) -> str:
        """Description of the active failsafe; empty while the autopilot follows setpoints or stands ready."""
        reason = self._emergencies.reason
        if self.mode is Mode.OFF:
            return f"{reason}: staying on the ground" if reason else ""
        if self.mode is Mode.ROTOR:
            return f"{reason}: landing"
        if self.mode is Mode.FENCE:
            return f"{self._wall} fence ahead: holding position"
        return "" if self.mode in (Mode.FOLLOW, Mode.PILOT) else self.mode.value

    @property
    def follows(self) -> bool:
        """A fresh setpoint counts, provided that the computer has the authority."""
        return not self._emergencies.reason if self.mode is Mode.OFF else self.mode not in OVERRULING

    @property
    def holds_heading(self) -> bool:
        """The heading can be controlled."""
        return self._attitude_loop.holds_heading

    def command(self, setpoint: Setpoint, t: float, of: float | None = None) -> None:
        """Take a setpoint that arrived at `t` and was made at the time `of`, by default `t`.

        It is ignored if it is older than the previous one, or than the failsafe's timeout.
        """
        stamp = t if of is None else min(of, t)
        if stamp >= self._stamp and t - stamp <= SETPOINT_TIMEOUT:
            self._setpoint, self._stamp = setpoint, stamp

    def battery(self, percent: float, voltage: float) -> None:
        """Take the battery's state before each `guide`: charge [%], and voltage under load [V]."""
        self._emergencies.battery(percent, voltage, GUIDE_PERIOD)

    def guide(self, t: float, now: Estimate, rate: Vector) -> None:
        """Choose the mode and the wanted attitude for the next 20 ms; `rate` is the angular rate (FLU) [rad/s]."""
        dt = GUIDE_PERIOD if self._guided is None else t - self._guided
        self._guided = t
        self._ground_speed.update(now)
        self._emergencies.navigation(t, valid=now.valid, velocity_valid=now.velocity_valid)
        self._watch_rotors(now, rate)
        self._choose_mode(t, now)
        if self.mode is Mode.OFF:
            return
        target = self._target(dt, now)
        self._commanded_climb = target.velocity[2]
        velocity = self._trusted_velocity(now, target)
        wanted = target.velocity
        if not self._emergencies.blind:
            wanted = position_to_velocity(now.position, target.position, target.velocity)
        acceleration = self._velocity_loop.acceleration(velocity, wanted, target.acceleration, dt)
        self._attitude_loop.aim(acceleration, target.heading, now.quaternion)
        if self._has_touched_down(t, now, velocity, target):
            self._enter(Mode.OFF, now)

    def stabilise(self, quaternion: Quaternion, rate: Vector) -> list[float]:
        """Rotor thrusts (6) [N]."""
        if self.mode is Mode.OFF:
            return [0.0] * ROTORS
        thrusts = self._attitude_loop.thrusts(quaternion, rate)
        self._rotors.commanded(thrusts)
        return thrusts

    # --- modes -----------------------------------------------------------------------------------------------

    def _watch_rotors(self, now: Estimate, rate: Vector) -> None:
        if self.mode is Mode.OFF or not self.holds_heading:
            return
        failed = self._rotors.update(rate)
        if failed is not None and not self._may_touch(now):
            self._emergencies.rotor = failed
            self._attitude_loop.drop(failed)
            self._velocity_loop.limit_tilt()

    def _choose_mode(self, t: float, now: Estimate) -> None:
        age = t - self._stamp
        emergency = self._emergencies.mode
        if self.mode is Mode.OFF:
            if emergency is None and self.authority and age <= SETPOINT_TIMEOUT and self._asks_to_rise(now):
                self._enter(Mode.FOLLOW, now)
        elif emergency is not None:
            self._enter(emergency, now)
        elif not self.authority:
            self._enter(Mode.PILOT, now)
        elif age <= SETPOINT_TIMEOUT:
            self._enter(Mode.FENCE if self._fence_stops(now) else Mode.FOLLOW, now)
        elif self.mode is Mode.PILOT:
            self._stamp = t - SETPOINT_TIMEOUT
            self._enter(Mode.HOVER, now)
        elif age > SETPOINT_TIMEOUT + HOLD_TIME:
            self._enter(Mode.LAND, now)
        else:
            self._enter(Mode.HOVER, now)

    def _fence_stops(self, now: Estimate) -> bool:
        """The motion would leave the fence, or the setpoint would after a stop at the fence."""
        wanted = self._setpoint
        if self._fence is None or wanted is None:
            return False
        wall = self._fence.threatened(now.position, now.velocity)
        if wall is None and self.mode is Mode.FENCE:
            wall = self._fence.threatened(wanted.position, wanted.velocity)
        self._wall = wall
        return wall is not None

    def _asks_to_rise(self, now: Estimate) -> bool:
        wanted = self._setpoint
        return wanted is not None and wanted.rotors and wanted.position[2] > now.position[2] + 0.05

    def _enter(self, mode: Mode, now: Estimate) -> None:
        if mode is self.mode:
            return
        if self.mode is Mode.OFF:
            self._velocity_loop.reset()
            self._attitude_loop.reset()
            self._rotors.reset()
        # The held position is kept from one failsafe to the next, unless it was found without navigation.
        holding = self.mode in (*LANDING, Mode.HOVER, Mode.FENCE) and self.mode is not Mode.NAVIGATION
        if mode is not Mode.FOLLOW and not (holding and mode in (*LANDING, Mode.HOVER)):
            stop = add(now.position, scale(_BRAKING_TIME, now.velocity))
            stop = stop if self._fence is None else self._fence.inside(stop)
            self._hold = Setpoint(stop, (0.0, 0.0, 0.0), heading_of(now.quaternion))
        self._touchdown.reset()
        self.mode = mode

    # --- targets -----------------------------------------------------------------------------------------------

    def _target(self, dt: float, now: Estimate) -> Setpoint:
        if self.mode is Mode.FOLLOW and self._setpoint is not None:
            return self._setpoint
        if self.mode in LANDING:
            blind = self._emergencies.blind
            sink = (0.0, 0.0, -sink_speed(now.ground, hurry=blind))
            here = now.position if blind else self._hold.position
            self._hold = Setpoint(add(here, scale(dt, sink)), sink, self._hold.heading)
        return self._hold

    def _trusted_velocity(self, now: Estimate, target: Setpoint) -> Vector:
        """Velocity for control. Without a valid one: the range-finder's vertical part, and the estimate of the rest."""
        if not self._emergencies.blind:
            return now.velocity
        x, y, z = now.velocity
        if self._is_near_ground(now):
            # A little drift at touchdown is better than a tilt against a speed that may not exist. With the wanted
            # velocity as input the loop keeps the tilt that it has found against the wind.
            x, y, _ = target.velocity
        return x, y, self._ground_speed.climb if now.ground is not None else z

    def _is_near_ground(self, now: Estimate) -> bool:
        return now.ground is not None and now.ground < STANDING_RANGE + _NEAR_GROUND

    def _may_touch(self, now: Estimate) -> bool:
        """Contacts may turn the drone: the ground is near, or the drone does not sink as commanded."""
        stands = self._commanded_climb < _DOWNWARD and now.velocity[2] > _SINKING * self._commanded_climb
        return stands or self._is_near_ground(now)

    def _has_touched_down(self, t: float, now: Estimate, velocity: Vector, target: Setpoint) -> bool:
        late = now.position[2] - target.position[2]
        sinking = late > 0.05 or target.velocity[2] < _DOWNWARD or not target.rotors
        insisting = late > _STANDS_ABOVE
        if self._emergencies.blind:
            # It sinks without a target height, and its horizontal speed is unknown.
            insisting, velocity = self.mode in LANDING, (0.0, 0.0, velocity[2])
        return self._touchdown.noticed(t, now, velocity, sinking=sinking, insisting=insisting)
