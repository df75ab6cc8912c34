"""Guidance: makes setpoints for the autopilot from the motions of goals, and refuses unsafe commands.

The core is pure: feed it navigation, flight state, obstacle reports and commands; `tick` gives the setpoint for now.
Each of the two axes, body and heading, has a holder of its own.
"""

from __future__ import annotations

import math

from skillwing.onboard.commands.authority import REVOKED, TAKEN_OVER, CommandAuthority
from skillwing.onboard.commands.service import CommandRefusedError
from skillwing.onboard.frames.extent import Box
from skillwing.onboard.frames.vectors import Vector
from skillwing.onboard.guidance.arc import rim
from skillwing.onboard.guidance.body_motion import BodyMotion
from skillwing.onboard.guidance.heading_control import HeadingControl
from skillwing.onboard.guidance.limits import GuidanceLimits
from skillwing.onboard.guidance.path_monitor import PathMonitor
from skillwing.onboard.sensor_data.names import RANGE
from skillwing.onboard.topics.flight import AutopilotSetpoint, FlightState
from skillwing.onboard.topics.guidance import (
    FlyTo,
    GuidanceCommand,
    GuidanceStatus,
    Land,
    Motion,
    MotionState,
    Orbit,
    Revoked,
    Stop,
    TakeOff,
    Turn,
    YawMode,
)
from skillwing.onboard.topics.navigation import Navigation
from skillwing.onboard.topics.obstacles import ObstacleStatus
from skillwing.onboard.topics.sensors import Health, SensorStatus
from skillwing.services.protocol import ErrorCode

LAND_AFTER = 30.0
"""Robot time without a commander, in the air, after which guidance lets the drone land [s]."""
_LEAST_RADIUS = 2.0
_GIVEN_BACK = (MotionState.IDLE, MotionState.STOPPED, MotionState.ABORTED)
"""States without a commander: a goal gives its axis back with a stop, and a revocation takes it away."""


class UnattendedTimer:
    """Timer of a drone in the air that no goal commands: it holds its position for a while, then it lands."""

    def __init__(self) -> None:
        self._since: float | None = None

    def update(self, t: float, *, commanded: bool) -> bool:
        """Test at `t` for a drone that was not commanded for so long that it has to land."""
        if commanded:
            self._since = None
            return False
        if self._since is None:
            self._since = t
        return t - self._since >= LAND_AFTER


class GuidanceCore:
    """Guidance of one drone inside a fence. Times are robot time; call `tick` at 50 Hz.

    `watch` False makes it ignore obstacle reports, for comparison.
    """

    def __init__(self, fence: Box, *, watch: bool = True) -> None:
        self._limits = GuidanceLimits(fence)
        self._monitor = PathMonitor()
        self._watch = watch
        self._heading = HeadingControl()
        self._body = BodyMotion(self._heading, self._limits, self._monitor)
        self._unattended = UnattendedTimer()
        self._navigation: Navigation | None = None
        self._flight: FlightState | None = None
        self._home: Vector | None = None
        self._ticked: float | None = None
        self._setpoint: Vector = (0.0, 0.0, 0.0)

    # --- inputs ----------------------------------------------------------------------------------------------

    def navigation(self, navigation: Navigation) -> None:
        self._navigation = navigation

    def flight(self, flight: FlightState) -> None:
        was = self._flight
        self._flight = flight
        if self._home is None and flight.on_ground and flight.home_valid and self._navigation is not None:
            self._home = self._navigation.position
        if was is not None and flight.on_ground and not was.on_ground:
            self._body.touched_down()
        if was is not None and was.authority and not flight.authority and self._body.has_plans:
            self._body.abort(flight.t, TAKEN_OVER)
        if was is not None and was.follows and not flight.follows and self._body.has_plans and not self._body.lands:
            self._body.abort(flight.t, f"the autopilot acts by itself ({flight.failsafe})")
        if was is not None and was.holds_heading and not flight.holds_heading:
            self._heading.give_up("the drone cannot hold its heading any more")

    def range(self, t: float, distance: float | None) -> None:
        """The range-finder's distance to the ground [m] at `t`, None if it sees none."""
        self._body.range(t, distance)

    def health(self, health: Health, t: float) -> None:
        """Take a sensor's health; only that of the range-finder matters here."""
        if health.sensor == RANGE:
            self._body.trust_range(t, trusted=health.status is not SensorStatus.FAILED)

    def obstacles(self, status: ObstacleStatus) -> None:
        if self._watch:
            self._monitor.report(status)

    def revoke(self, revoked: Revoked, t: float) -> None:
        """Refuse the goal's commands from now on; an axis that it held brakes and holds still."""
        body, heading = self._body.axis, self._heading.axis
        if body.revoke(revoked.goal_id, revoked.token):
            if self._body.has_plans:
                self._body.abort(t, REVOKED)
            elif body.state in (MotionState.DONE, MotionState.BLOCKED):
                body.become(MotionState.ABORTED, REVOKED)
        if heading.revoke(revoked.goal_id, revoked.token) and heading.state is MotionState.TURNING:
            self._heading.stop(MotionState.ABORTED, REVOKED)

    def command(self, command: GuidanceCommand, t: float) -> str:
        """Accept a command, and return a sentence about it. Raises CommandRefusedError.

        The command itself yields no setpoint: the next `tick` does, after the next navigation message.
        """
        motion = command.motion
        if isinstance(motion, Stop):
            return self._stop(command, t)
        flight, navigation = self._require_ready(motion)
        axes = self._axes_of(motion)
        for axis in axes:
            axis.require_fresh(command.goal_id, command.token)
        if self._body.axis.goal == command.goal_id and self._body.is_flying(motion):
            return "already under way"
        self._require_possible(motion, flight, navigation)
        self._body.require_in_view(motion, navigation, t)
        for axis in axes:
            axis.take(command.goal_id, command.token)
        if isinstance(motion, Turn):
            self._heading.turn_to(motion.heading, navigation.heading)
            return "turning"
        self._body.start(motion, navigation, t)
        return "under way"

    # --- outputs ---------------------------------------------------------------------------------------------

    def tick(self, t: float) -> AutopilotSetpoint | None:
        """The setpoint for now; None while there is nothing to fly.

        It is also None once no goal has commanded the drone for 30 s: without setpoints the autopilot lands it.
        """
        dt = 0.0 if self._ticked is None else t - self._ticked
        self._ticked = t
        navigation, flight, body = self._navigation, self._flight, self._body
        if navigation is None or flight is None:
            return None
        if flight.on_ground and not body.rises:
            body.rest()
            self._setpoint = navigation.position
            self._heading.hold(navigation.heading)
            self._unattended.update(t, commanded=True)
            return None
        if self._unattended.update(t, commanded=body.axis.state not in _GIVEN_BACK or not flight.authority):
            body.path, self._setpoint = None, navigation.position
            body.axis.become(body.axis.state, f"nobody has commanded the drone for {LAND_AFTER:g} s: it lands")
            return None
        if body.path is None or not flight.authority or not flight.follows:
            body.hold(navigation.position, t)
            self._heading.hold(navigation.heading)
        self._heading.advance(dt, navigation.heading)
        body.advance(t, navigation)
        self._setpoint, velocity, acceleration = body.place(t)
        return AutopilotSetpoint(
            t=t,
            position=self._setpoint,
            velocity=velocity,
            heading=self._heading.setpoint,
            rotors=True,
            acceleration=acceleration,
        )

    def status(self, t: float) -> GuidanceStatus:
        body = self._body
        return GuidanceStatus(
            t=t,
            body=body.axis.status,
            heading=self._heading.axis.status,
            setpoint=self._setpoint,
            target=body.target,
            free_distance=self._monitor.free_distance,
            way=body.way(t),
            laps_done=body.laps_done(t),
        )

    @property
    def targets(self) -> Box:
        """The box of permitted targets."""
        return self._limits.targets

    @property
    def home(self) -> Vector | None:
        """The drone's position at its first fix on the ground."""
        return self._home

    # --- commands --------------------------------------------------------------------------------------------

    def _require_ready(self, motion: Motion) -> tuple[FlightState, Navigation]:
        if self._flight is None or self._navigation is None:
            raise CommandRefusedError(
                ErrorCode.UNAVAILABLE, "guidance does not know yet where the drone is", "wait for the first fix"
            )
        if not self._flight.authority:
            raise CommandRefusedError(
                ErrorCode.NOT_ALLOWED, "the safety pilot has the authority", "wait until the pilot gives it back"
            )
        if not self._flight.follows and not isinstance(motion, Land):
            raise CommandRefusedError(
                ErrorCode.NOT_ALLOWED,
                f"the autopilot acts by itself ({self._flight.failsafe})",
                "let it; it takes no command for as long",
            )
        return self._flight, self._navigation

    def _axes_of(self, motion: Motion) -> tuple[CommandAuthority, ...]:
        match motion:
            case Turn():
                return (self._heading.axis,)
            case FlyTo(nose=YawMode.ALONG_TRACK | YawMode.IN_VIEW) | Orbit():
                return self._body.axis, self._heading.axis
            case _:
                return (self._body.axis,)

    def _require_possible(self, motion: Motion, flight: FlightState, navigation: Navigation) -> None:
        if isinstance(motion, TakeOff):
            if not flight.on_ground:
                raise CommandRefusedError(ErrorCode.NOT_ALLOWED, "the drone is already in the air", "use fly_to")
            if self._home is None:
                raise CommandRefusedError(ErrorCode.UNAVAILABLE, "the home point is not fixed yet", "wait a second")
        elif flight.on_ground:
            raise CommandRefusedError(ErrorCode.NOT_ALLOWED, "the drone stands on the ground", "take off first")
        match motion:
            case TakeOff(height=height, speed=speed):
                self._limits.require_speed(speed)
                self._limits.require_inside((*navigation.position[:2], height))
            case FlyTo(target=target, speed=speed):
                self._limits.require_inside(target)
                self._limits.require_speed(speed)
            case Land(speed=speed):
                self._limits.require_speed(speed)
            case Orbit():
                self._require_round(motion)
            case _:
                pass

    def _require_round(self, orbit: Orbit) -> None:
        if orbit.radius < _LEAST_RADIUS or not math.isfinite(orbit.laps) or orbit.laps <= 0.0:
            raise CommandRefusedError(
                ErrorCode.BAD_REQUEST,
                f"{orbit.laps:g} laps on a radius of {orbit.radius:g} m cannot be flown",
                f"give a part of a lap at least, on {_LEAST_RADIUS:g} m at least",
            )
        self._limits.require_inside(*rim(orbit))
        self._limits.require_speed(orbit.speed)

    def _stop(self, command: GuidanceCommand, t: float) -> str:
        held = [axis for axis in (self._body.axis, self._heading.axis) if axis.goal == command.goal_id]
        if not held:
            raise CommandRefusedError(
                ErrorCode.UNKNOWN_GOAL, f"goal {command.goal_id} holds no axis", "there is nothing to stop"
            )
        for axis in held:
            axis.require_fresh(command.goal_id, command.token)
        if self._heading.axis in held and self._heading.axis.state is not MotionState.ABORTED:
            self._heading.stop(MotionState.STOPPED)
        if self._body.axis in held and self._body.axis.state is not MotionState.ABORTED:
            self._body.brake(t, MotionState.STOPPED)
        return "stopping"
