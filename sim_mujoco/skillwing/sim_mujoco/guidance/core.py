"""Guidance: turns motions that a goal asks for into setpoints for the autopilot, and refuses what is not safe.

A pure core: feed it navigation, flight state, obstacle reports and commands; `tick` gives the setpoint for now.
Two axes have a holder each: the body (where the drone is) and the heading (where its nose points).
"""

from __future__ import annotations

import math

from skillwing.services.protocol import ErrorCode
from skillwing.sim_mujoco.axis import Axis, RefusedError
from skillwing.sim_mujoco.frames.vectors import Vector, norm, subtract
from skillwing.sim_mujoco.geofence import COURTYARD_FENCE, Box
from skillwing.sim_mujoco.guidance.heading_control import HeadingControl
from skillwing.sim_mujoco.guidance.lookout import Lookout, View
from skillwing.sim_mujoco.guidance.solitude import LAND_AFTER, Solitude
from skillwing.sim_mujoco.guidance.trajectory import BRAKING, Segment, straight
from skillwing.sim_mujoco.topics import (
    AutopilotSetpoint,
    FlightState,
    FlyTo,
    GuidanceCommand,
    GuidanceStatus,
    Land,
    Motion,
    MotionState,
    Navigation,
    Nose,
    ObstacleStatus,
    Revoked,
    Stop,
    TakeOff,
    Turn,
)

LOWEST, HIGHEST = 1.0, 30.0
"""Heights above the home pad at which a target may lie [m]."""
ARRIVED_WITHIN = 0.3
_AT_REST = 0.25
_DRIFT = 3.0
_FENCE_MARGIN = 1.0
_PATIENCE = 10.0
"""How long after its planned end a motion may take to get there before it counts as blocked [s]."""
_MAX_CLIMB, _MAX_SPEED = 1.8, 6.0
_FLARE_HEIGHT, _TOUCHDOWN_SPEED = 1.5, 0.5
_BELOW_ANY_GROUND = 50.0
_RANGE_VALID = 0.5
_ZERO: Vector = (0.0, 0.0, 0.0)
_UNDER_WAY = (MotionState.TURNING, MotionState.MOVING, MotionState.WAITING)
_BUSY = (*_UNDER_WAY, MotionState.STOPPING)
_GIVEN_BACK = (MotionState.IDLE, MotionState.STOPPED, MotionState.ABORTED)
"""Nobody commands the axis: a goal that is over gives it back with a stop, and a revocation takes it."""


class GuidanceCore:
    """One drone's guidance inside a fence. Times are robot time; call `tick` at 50 Hz."""

    def __init__(self, fence: Box = COURTYARD_FENCE) -> None:
        self._fence = fence
        self._body = Axis("body axes")
        self._heading = HeadingControl()
        self._lookout = Lookout()
        self._solitude = Solitude()
        self._navigation: Navigation | None = None
        self._flight: FlightState | None = None
        self._range: tuple[float, float | None] = (-math.inf, None)
        self._home: Vector | None = None
        self._segment: Segment | None = None
        self._motion: Motion | None = None
        self._next: Motion | None = None
        self._after_stop = (MotionState.STOPPED, "")
        self._ticked: float | None = None
        self._setpoint: Vector = _ZERO

    # --- what comes in ---------------------------------------------------------------------------------------

    def navigation(self, navigation: Navigation) -> None:
        self._navigation = navigation

    def flight(self, flight: FlightState) -> None:
        was = self._flight
        self._flight = flight
        if self._home is None and flight.on_ground and flight.home_valid and self._navigation is not None:
            self._home = self._navigation.position
        if was is not None and flight.on_ground and not was.on_ground:
            self._touched_down()
        if was is not None and was.authority and not flight.authority and self._has_plans:
            self._abort(flight.t, "the safety pilot has taken over")

    def range(self, t: float, distance: float | None) -> None:
        """The range-finder's distance to the ground [m] at `t`, None if it sees none."""
        self._range = t, distance

    def obstacles(self, status: ObstacleStatus) -> None:
        self._lookout.report(status)

    def revoke(self, revoked: Revoked, t: float) -> None:
        """The goal's commands no longer count; what it held brakes and holds still."""
        if self._body.revoke(revoked.goal_id, revoked.token):
            if self._has_plans:
                self._abort(t, "its authority was revoked")
            elif self._body.state in (MotionState.DONE, MotionState.BLOCKED):
                self._body.become(MotionState.ABORTED, "its authority was revoked")
        axis = self._heading.axis
        if axis.revoke(revoked.goal_id, revoked.token) and axis.state is MotionState.TURNING:
            self._heading.stop(MotionState.ABORTED, "its authority was revoked")

    def command(self, command: GuidanceCommand, t: float) -> str:
        """Take a command; the answer says in words what will happen. Raises RefusedError."""
        motion = command.motion
        if isinstance(motion, Stop):
            return self._stop(command, t)
        flight, navigation = self._require_ready()
        axes = self._axes_of(motion)
        for axis in axes:
            axis.require_fresh(command.goal_id, command.token)
        if self._is_repeated(command):
            return "already under way"
        self._require_possible(motion, flight)
        for axis in axes:
            axis.take(command.goal_id, command.token)
        if isinstance(motion, Turn):
            self._heading.turn_to(motion.heading, navigation.heading)
            return "turning"
        self._start(motion, t)
        return "under way"

    # --- what goes out ---------------------------------------------------------------------------------------

    def tick(self, t: float) -> AutopilotSetpoint | None:
        """The setpoint for now; None while there is nothing to fly.

        That includes a drone that nobody has commanded for 30 s: without setpoints the autopilot lands it.
        """
        dt = 0.0 if self._ticked is None else t - self._ticked
        self._ticked = t
        navigation, flight = self._navigation, self._flight
        if navigation is None or flight is None:
            return None
        if self._is_grounded(flight):
            self._segment, self._setpoint = None, navigation.position
            self._heading.settle(navigation.heading)
            if self._body.state is MotionState.STOPPING:
                self._body.become(*self._after_stop)
            self._solitude.update(t, commanded=True)
            return None
        if self._solitude.update(t, commanded=self._body.state not in _GIVEN_BACK or not flight.authority):
            self._segment, self._setpoint = None, navigation.position
            self._body.become(self._body.state, f"nobody has commanded the drone for {LAND_AFTER:g} s: it lands")
            return None
        if self._segment is None or not flight.authority:
            self._segment = straight(navigation.position, navigation.position, 1.0, t)
            self._heading.settle(navigation.heading)
        self._heading.advance(dt, navigation.heading)
        self._advance(t, navigation, flight)
        self._setpoint, velocity, acceleration = self._segment.at(t)
        return AutopilotSetpoint(
            t=t,
            position=self._setpoint,
            velocity=velocity,
            heading=self._heading.setpoint,
            rotors=True,
            acceleration=acceleration,
        )

    def status(self, t: float) -> GuidanceStatus:
        motion = self._motion
        under_way = self._body.state in (*_BUSY, MotionState.BLOCKED)
        return GuidanceStatus(
            t=t,
            body=self._body.status,
            heading=self._heading.axis.status,
            setpoint=self._setpoint,
            target=motion.target if isinstance(motion, FlyTo) and under_way else None,
            free_distance=self._lookout.free_distance,
        )

    @property
    def home(self) -> Vector | None:
        """Where the drone stood at its first fix on the ground."""
        return self._home

    # --- commands --------------------------------------------------------------------------------------------

    def _require_ready(self) -> tuple[FlightState, Navigation]:
        if self._flight is None or self._navigation is None:
            raise RefusedError(
                ErrorCode.UNAVAILABLE, "guidance does not know yet where the drone is", "wait for the first fix"
            )
        if not self._flight.authority:
            raise RefusedError(
                ErrorCode.NOT_ALLOWED, "the safety pilot has the authority", "wait until the pilot gives it back"
            )
        return self._flight, self._navigation

    def _axes_of(self, motion: Motion) -> tuple[Axis, ...]:
        if isinstance(motion, Turn):
            return (self._heading.axis,)
        if isinstance(motion, FlyTo) and motion.nose is Nose.ALONG_TRACK:
            return self._body, self._heading.axis
        return (self._body,)

    def _is_repeated(self, command: GuidanceCommand) -> bool:
        known = self._body.state in (*_BUSY, MotionState.DONE) and command.motion in (self._motion, self._next)
        return known and self._body.goal == command.goal_id

    def _require_possible(self, motion: Motion, flight: FlightState) -> None:
        if isinstance(motion, TakeOff):
            if not flight.on_ground:
                raise RefusedError(ErrorCode.NOT_ALLOWED, "the drone is already in the air", "use fly_to")
            if self._home is None:
                raise RefusedError(ErrorCode.UNAVAILABLE, "the home point is not fixed yet", "wait a second")
            self._require_speed(motion.speed)
            self._require_inside((self._home[0], self._home[1], motion.height))
            return
        if flight.on_ground:
            raise RefusedError(ErrorCode.NOT_ALLOWED, "the drone stands on the ground", "take off first")
        if isinstance(motion, FlyTo):
            self._require_inside(motion.target)
        if isinstance(motion, FlyTo | Land):
            self._require_speed(motion.speed)

    def _require_inside(self, target: Vector) -> None:
        low = (self._fence.low[0], self._fence.low[1], max(self._fence.low[2], LOWEST))
        high = (self._fence.high[0], self._fence.high[1], min(self._fence.high[2], HIGHEST))
        if not Box(low, high).contains(target):
            raise RefusedError(
                ErrorCode.NOT_ALLOWED,
                "the target ({:.1f}, {:.1f}, {:.1f}) lies outside the geofence".format(*target),
                "stay between ({:g}, {:g}, {:g}) and ({:g}, {:g}, {:g})".format(*low, *high),
            )

    @staticmethod
    def _require_speed(speed: float) -> None:
        if not 0.0 < speed <= _MAX_SPEED:
            raise RefusedError(
                ErrorCode.BAD_REQUEST, f"a speed of {speed:g} m/s cannot be flown", f"give 0 to {_MAX_SPEED:g} m/s"
            )

    def _stop(self, command: GuidanceCommand, t: float) -> str:
        held = [axis for axis in (self._body, self._heading.axis) if axis.goal == command.goal_id]
        if not held:
            raise RefusedError(
                ErrorCode.UNKNOWN_GOAL, f"goal {command.goal_id} holds no axis", "there is nothing to stop"
            )
        for axis in held:
            axis.require_fresh(command.goal_id, command.token)
        if self._heading.axis in held and self._heading.axis.state is not MotionState.ABORTED:
            self._heading.stop(MotionState.STOPPED)
        if self._body in held and self._body.state is not MotionState.ABORTED:
            self._brake(t, MotionState.STOPPED)
        return "stopping"

    @property
    def _has_plans(self) -> bool:
        """The holder's motion is under way, or will be as soon as the one before has come to rest."""
        return self._body.state in _UNDER_WAY or self._next is not None

    # --- the body's motion -----------------------------------------------------------------------------------

    def _start(self, motion: Motion, t: float) -> None:
        """Begin a motion, after coming to rest from the one before."""
        if self._segment is not None and not self._segment.is_over(t):
            self._segment = self._segment.broken_off(t)
            self._motion, self._next = None, motion
            self._body.become(MotionState.STOPPING, "ending the motion before")
            return
        self._motion, self._next = motion, None
        navigation = self._navigation
        assert navigation is not None
        here = self._segment.end if self._segment is not None else navigation.position
        if isinstance(motion, TakeOff):
            self._heading.settle(navigation.heading)
            self._go(here, (here[0], here[1], motion.height), motion.speed, t)
        elif isinstance(motion, FlyTo):
            self._start_leg(motion, here, navigation, t)
        elif isinstance(motion, Land):
            self._start_descent(motion, here, t)
        else:
            self._body.become(MotionState.DONE)

    def _start_leg(self, leg: FlyTo, here: Vector, navigation: Navigation, t: float) -> None:
        self._lookout.begin(t)
        way = subtract(leg.target, here)
        self._body.remaining = norm(way)
        if leg.nose is Nose.ALONG_TRACK and math.hypot(way[0], way[1]) > 0.5:
            self._heading.turn_to(math.atan2(way[1], way[0]), navigation.heading)
            if not self._heading.aligned:
                self._body.become(MotionState.TURNING)
                return
        self._go(here, leg.target, leg.speed, t)

    def _start_descent(self, landing: Land, here: Vector, t: float) -> None:
        """Come down to 1.5 m above the ground if it is in view, and gently from there."""
        ground = self._ground(t)
        if ground is not None and ground > _FLARE_HEIGHT + 1.0:
            self._go(here, (here[0], here[1], here[2] - (ground - _FLARE_HEIGHT)), landing.speed, t)
        else:
            self._go(here, (here[0], here[1], here[2] - _BELOW_ANY_GROUND), min(landing.speed, _TOUCHDOWN_SPEED), t)

    def _ground(self, t: float) -> float | None:
        """Distance to the ground, if the range-finder has told it lately."""
        measured, distance = self._range
        return distance if t - measured <= _RANGE_VALID else None

    def _go(self, here: Vector, target: Vector, speed: float, t: float) -> None:
        way = subtract(target, here)
        climb = abs(way[2]) / max(norm(way), 1e-9)
        if climb > 0.0:
            speed = min(speed, _MAX_CLIMB / climb)
        self._segment = straight(here, target, speed, t)
        self._lookout.begin(t)
        self._body.become(MotionState.MOVING)

    def _brake(self, t: float, then: MotionState, text: str = "") -> None:
        if self._segment is not None and not self._segment.is_over(t):
            self._segment = self._segment.broken_off(t)
        self._after_stop = then, text
        self._next = None
        self._body.become(MotionState.STOPPING, text)

    def _abort(self, t: float, why: str) -> None:
        """Give the holder's motion up: brake, and report it as aborted once at rest."""
        self._brake(t, MotionState.ABORTED, why)
        if self._heading.axis.goal == self._body.goal and self._heading.axis.state is MotionState.TURNING:
            self._heading.stop(MotionState.ABORTED, why)

    def _touched_down(self) -> None:
        self._segment = None
        if isinstance(self._motion, Land) and self._body.state is MotionState.MOVING:
            self._body.remaining = 0.0
            self._body.become(MotionState.DONE)
        elif self._has_plans:
            self._body.become(MotionState.ABORTED, "the autopilot has landed")
        self._next = None

    def _is_grounded(self, flight: FlightState) -> bool:
        return flight.on_ground and not (isinstance(self._motion, TakeOff) and self._body.state is MotionState.MOVING)

    def _advance(self, t: float, navigation: Navigation, flight: FlightState) -> None:
        state, segment = self._body.state, self._segment
        assert segment is not None
        if state in _UNDER_WAY and not self._fence.contains(navigation.position, _FENCE_MARGIN):
            self._abort(t, "the drone has left the geofence")
        elif state is MotionState.STOPPING:
            self._advance_stop(t, navigation, segment)
        elif state is MotionState.TURNING and isinstance(self._motion, FlyTo):
            self._advance_turn(self._motion, segment, t)
        elif state is MotionState.WAITING and isinstance(self._motion, FlyTo):
            if self._lookout.is_fresh(t):
                self._start_leg(self._motion, segment.end, navigation, t)
            elif t - segment.began > segment.profile.duration + _PATIENCE:
                self._body.become(MotionState.BLOCKED, f"no view of the way ahead for {_PATIENCE:g} s")
        elif state is MotionState.MOVING:
            self._advance_motion(t, navigation, segment)

    def _advance_stop(self, t: float, navigation: Navigation, segment: Segment) -> None:
        at_rest = norm(navigation.velocity) <= _AT_REST
        # In a storm the drone may never come to rest; whoever waits for it must not wait for ever.
        overdue = t - segment.began > segment.profile.duration + _PATIENCE
        if not segment.is_over(t) or not (at_rest or overdue):
            return
        if self._next is not None:
            self._start(self._next, t)
        else:
            self._body.become(*self._after_stop)

    def _advance_turn(self, leg: FlyTo, segment: Segment, t: float) -> None:
        if self._heading.axis.goal != self._body.goal:
            self._abort(t, "another goal has taken the heading")
        elif self._heading.aligned:
            self._go(segment.end, leg.target, leg.speed, t)

    def _advance_motion(self, t: float, navigation: Navigation, segment: Segment) -> None:
        position, velocity, _ = segment.at(t)
        off = norm(subtract(position, navigation.position))
        self._body.remaining = norm(subtract(segment.end, navigation.position))
        if isinstance(self._motion, Land):
            self._advance_landing(self._motion, t, navigation, segment)
        elif off > _DRIFT:
            self._abort(t, f"the drone has drifted {off:.1f} m from its path")
        elif segment.is_over(t):
            self._conclude(t, navigation, segment)
        elif isinstance(self._motion, FlyTo):
            self._look_ahead(t, norm(velocity))

    def _advance_landing(self, landing: Land, t: float, navigation: Navigation, segment: Segment) -> None:
        ground = self._ground(t)
        height = ground if ground is not None else navigation.position[2]
        self._body.remaining = max(0.0, height)
        late = navigation.position[2] - segment.at(t)[0][2]
        if late > _DRIFT:
            self._brake(t, MotionState.BLOCKED, "the drone does not come down")
        elif segment.is_over(t):
            self._start_descent(landing, segment.end, t)

    def _conclude(self, t: float, navigation: Navigation, segment: Segment) -> None:
        if self._body.remaining <= ARRIVED_WITHIN and norm(navigation.velocity) <= _AT_REST:
            self._body.become(MotionState.DONE)
        elif t - segment.began > segment.profile.duration + _PATIENCE:
            self._body.become(MotionState.BLOCKED, f"no headway, {self._body.remaining:.1f} m short of the target")

    def _look_ahead(self, t: float, speed: float) -> None:
        view = self._lookout.view(t, speed, self._body.remaining, BRAKING)
        if view is View.BLOCKED:
            self._brake(t, MotionState.BLOCKED, "an obstacle stands on the way")
        elif view is View.BLIND:
            self._brake(t, MotionState.WAITING, "no fresh view of the way ahead")
