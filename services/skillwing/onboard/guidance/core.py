"""Guidance: turns motions that a goal asks for into setpoints for the autopilot, and refuses what is not safe.

A pure core: feed it navigation, flight state, obstacle reports and commands; `tick` gives the setpoint for now.
Two axes have a holder each: the body (where the drone is) and the heading (where its nose points).
"""

from __future__ import annotations

import math

from skillwing.onboard.axis import Axis, RefusedError
from skillwing.onboard.frames.vectors import Vector
from skillwing.onboard.geofence import Box
from skillwing.onboard.guidance.arc import rim
from skillwing.onboard.guidance.body_motion import BodyMotion
from skillwing.onboard.guidance.heading_control import HeadingControl
from skillwing.onboard.guidance.limits import Limits
from skillwing.onboard.guidance.lookout import Lookout
from skillwing.onboard.guidance.solitude import LAND_AFTER, Solitude
from skillwing.onboard.sensor_data.names import RANGE
from skillwing.onboard.topics import (
    AutopilotSetpoint,
    FlightState,
    FlyTo,
    GuidanceCommand,
    GuidanceStatus,
    Health,
    Land,
    Motion,
    MotionState,
    Navigation,
    Nose,
    ObstacleStatus,
    Orbit,
    Revoked,
    SensorStatus,
    Stop,
    TakeOff,
    Turn,
)
from skillwing.services.protocol import ErrorCode

_LEAST_RADIUS = 2.0
_GIVEN_BACK = (MotionState.IDLE, MotionState.STOPPED, MotionState.ABORTED)
"""Nobody commands the axis: a goal that is over gives it back with a stop, and a revocation takes it."""


class GuidanceCore:
    """One drone's guidance inside a fence. Times are robot time; call `tick` at 50 Hz.

    `watch` False makes it deaf to obstacle reports: for showing what they are good for.
    """

    def __init__(self, fence: Box, *, watch: bool = True) -> None:
        self._limits = Limits(fence)
        self._lookout = Lookout()
        self._watch = watch
        self._heading = HeadingControl()
        self._body = BodyMotion(self._heading, self._limits, self._lookout)
        self._solitude = Solitude()
        self._navigation: Navigation | None = None
        self._flight: FlightState | None = None
        self._home: Vector | None = None
        self._ticked: float | None = None
        self._setpoint: Vector = (0.0, 0.0, 0.0)

    # --- what comes in ---------------------------------------------------------------------------------------

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
            self._body.abort(flight.t, "the safety pilot has taken over")
        if was is not None and was.follows and not flight.follows and self._body.has_plans and not self._body.lands:
            self._body.abort(flight.t, f"the autopilot acts by itself ({flight.failsafe})")
        if was is not None and was.holds_heading and not flight.holds_heading:
            self._heading.give_up("the drone cannot hold its heading any more")

    def range(self, t: float, distance: float | None) -> None:
        """The range-finder's distance to the ground [m] at `t`, None if it sees none."""
        self._body.range(t, distance)

    def health(self, health: Health, t: float) -> None:
        """What a sensor says of itself; only the range-finder's word matters here."""
        if health.sensor == RANGE:
            self._body.trust_range(t, trusted=health.status is not SensorStatus.FAILED)

    def obstacles(self, status: ObstacleStatus) -> None:
        if self._watch:
            self._lookout.report(status)

    def revoke(self, revoked: Revoked, t: float) -> None:
        """The goal's commands no longer count; what it held brakes and holds still."""
        body, heading = self._body.axis, self._heading.axis
        if body.revoke(revoked.goal_id, revoked.token):
            if self._body.has_plans:
                self._body.abort(t, "its authority was revoked")
            elif body.state in (MotionState.DONE, MotionState.BLOCKED):
                body.become(MotionState.ABORTED, "its authority was revoked")
        if heading.revoke(revoked.goal_id, revoked.token) and heading.state is MotionState.TURNING:
            self._heading.stop(MotionState.ABORTED, "its authority was revoked")

    def command(self, command: GuidanceCommand, t: float) -> str:
        """Take a command; the answer says in words what will happen. Raises RefusedError."""
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

    # --- what goes out ---------------------------------------------------------------------------------------

    def tick(self, t: float) -> AutopilotSetpoint | None:
        """The setpoint for now; None while there is nothing to fly.

        That includes a drone that nobody has commanded for 30 s: without setpoints the autopilot lands it.
        """
        dt = 0.0 if self._ticked is None else t - self._ticked
        self._ticked = t
        navigation, flight, body = self._navigation, self._flight, self._body
        if navigation is None or flight is None:
            return None
        if flight.on_ground and not body.rises:
            body.rest()
            self._setpoint = navigation.position
            self._heading.settle(navigation.heading)
            self._solitude.update(t, commanded=True)
            return None
        if self._solitude.update(t, commanded=body.axis.state not in _GIVEN_BACK or not flight.authority):
            body.path, self._setpoint = None, navigation.position
            body.axis.become(body.axis.state, f"nobody has commanded the drone for {LAND_AFTER:g} s: it lands")
            return None
        if body.path is None or not flight.authority or not flight.follows:
            body.hold(navigation.position, t)
            self._heading.settle(navigation.heading)
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
            free_distance=self._lookout.free_distance,
            way=body.way(t),
            laps_done=body.laps_done(t),
        )

    @property
    def targets(self) -> Box:
        """Where the target of a motion may lie."""
        return self._limits.targets

    @property
    def home(self) -> Vector | None:
        """Where the drone stood at its first fix on the ground."""
        return self._home

    # --- commands --------------------------------------------------------------------------------------------

    def _require_ready(self, motion: Motion) -> tuple[FlightState, Navigation]:
        if self._flight is None or self._navigation is None:
            raise RefusedError(
                ErrorCode.UNAVAILABLE, "guidance does not know yet where the drone is", "wait for the first fix"
            )
        if not self._flight.authority:
            raise RefusedError(
                ErrorCode.NOT_ALLOWED, "the safety pilot has the authority", "wait until the pilot gives it back"
            )
        if not self._flight.follows and not isinstance(motion, Land):
            raise RefusedError(
                ErrorCode.NOT_ALLOWED,
                f"the autopilot acts by itself ({self._flight.failsafe})",
                "let it; it takes no command for as long",
            )
        return self._flight, self._navigation

    def _axes_of(self, motion: Motion) -> tuple[Axis, ...]:
        match motion:
            case Turn():
                return (self._heading.axis,)
            case FlyTo(nose=Nose.ALONG_TRACK | Nose.IN_VIEW) | Orbit():
                return self._body.axis, self._heading.axis
            case _:
                return (self._body.axis,)

    def _require_possible(self, motion: Motion, flight: FlightState, navigation: Navigation) -> None:
        if isinstance(motion, TakeOff):
            if not flight.on_ground:
                raise RefusedError(ErrorCode.NOT_ALLOWED, "the drone is already in the air", "use fly_to")
            if self._home is None:
                raise RefusedError(ErrorCode.UNAVAILABLE, "the home point is not fixed yet", "wait a second")
        elif flight.on_ground:
            raise RefusedError(ErrorCode.NOT_ALLOWED, "the drone stands on the ground", "take off first")
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
            raise RefusedError(
                ErrorCode.BAD_REQUEST,
                f"{orbit.laps:g} laps on a radius of {orbit.radius:g} m cannot be flown",
                f"give a part of a lap at least, on {_LEAST_RADIUS:g} m at least",
            )
        self._limits.require_inside(*rim(orbit))
        self._limits.require_speed(orbit.speed)

    def _stop(self, command: GuidanceCommand, t: float) -> str:
        held = [axis for axis in (self._body.axis, self._heading.axis) if axis.goal == command.goal_id]
        if not held:
            raise RefusedError(
                ErrorCode.UNKNOWN_GOAL, f"goal {command.goal_id} holds no axis", "there is nothing to stop"
            )
        for axis in held:
            axis.require_fresh(command.goal_id, command.token)
        if self._heading.axis in held and self._heading.axis.state is not MotionState.ABORTED:
            self._heading.stop(MotionState.STOPPED)
        if self._body.axis in held and self._body.axis.state is not MotionState.ABORTED:
            self._body.brake(t, MotionState.STOPPED)
        return "stopping"
