"""The body's motion: a setpoint for every moment of a goal's motion, short of obstacles and inside the fence.

A motion consists of legs along paths that begin and end at rest. A flight to a new target may begin earlier. To stop a
motion early, the drone brakes along its path; the status shows the motion's end state once the drone is at rest.
"""

from __future__ import annotations

import math
from typing import TypeAlias

from skillwing.onboard.commands.authority import NO_VIEW, CommandAuthority
from skillwing.onboard.frames.vectors import Vector, norm, scale, subtract, wrap
from skillwing.onboard.guidance.arc import Arc, Round
from skillwing.onboard.guidance.heading_control import HeadingControl
from skillwing.onboard.guidance.limits import MAX_SPEED, GuidanceLimits
from skillwing.onboard.guidance.path_monitor import PathMonitor, PathVisibility, stopping_distance
from skillwing.onboard.guidance.trajectory import JOINING_SPEED, Blend, Segment, continued, joined, straight
from skillwing.onboard.topics.guidance import FlyTo, Land, Motion, MotionState, Orbit, TakeOff, YawMode
from skillwing.onboard.topics.navigation import Navigation

Path: TypeAlias = Segment | Arc | Blend
Leg: TypeAlias = FlyTo | Round
"""A part of a motion along a monitored path."""
ARRIVED_WITHIN = 0.3
"""Largest distance from a path's end at which the drone may come to rest [m]."""
UNDER_WAY = (MotionState.TURNING, MotionState.MOVING, MotionState.WAITING)
BUSY = (*UNDER_WAY, MotionState.STOPPING)
AT_REST = 0.25
"""Speed below which the drone counts as at rest [m/s]."""
DRIFT = 3.0
"""Largest distance of the drone from its path [m]."""
PATIENCE = 10.0
"""Time after the planned end of a path at which the motion counts as blocked [s]."""
_REPORT_WAIT = 1.0
"""Longest wait of a round for a report on its way before it begins, if there is a depth map [s]."""
_PUBLISHED_AHEAD = stopping_distance(MAX_SPEED)
"""Length of a bent way in the status, for the obstacle node [m]."""
MAX_CLIMB = 1.8
"""Largest vertical speed [m/s]."""
FLARE_HEIGHT, TOUCHDOWN_SPEED = 1.5, 0.5
"""Height above the ground [m] below which a landing slows down to this speed [m/s]."""
_BELOW_ANY_GROUND = 50.0
_RANGE_VALID = 0.5
_STILL: Vector = (0.0, 0.0, 0.0)


class BodyMotion:
    """One motion after another; call `advance` at 50 Hz, then `place` for the setpoint."""

    def __init__(self, heading: HeadingControl, limits: GuidanceLimits, monitor: PathMonitor) -> None:
        self.axis = CommandAuthority("body axes")
        self.path: Path | None = None
        self._heading = heading
        self._limits = limits
        self._monitor = monitor
        self._motion: Motion | None = None
        self._next: Motion | None = None
        self._legs: list[Leg] = []
        self._across: bool | None = None
        """Side of the drone that was turned along the first leg, as in `PathMonitor.begin`."""
        self._after_stop = (MotionState.STOPPED, "")
        self._range: tuple[float, float | None] = (-math.inf, None)
        self._range_is_trusted = True
        self._turning_since = 0.0

    def range(self, t: float, distance: float | None) -> None:
        """The range-finder's distance to the ground [m] at `t`, None if it sees none."""
        self._range = t, distance if self._range_is_trusted else None

    def trust_range(self, t: float, *, trusted: bool) -> None:
        """Trust the range-finder or not. A descent by its distances goes on as one that sees no ground."""
        self._range_is_trusted = trusted
        if trusted:
            return
        self._range = t, None
        if self.lands and self.path is not None:
            self.path = self.path.broken_off(t)

    # --- state -----------------------------------------------------------------------------------------------

    @property
    def has_plans(self) -> bool:
        """The holder's motion is under way, or will be once the previous one is at rest."""
        return self.axis.state in UNDER_WAY or self._next is not None

    @property
    def rises(self) -> bool:
        """The drone is taking off."""
        return isinstance(self._motion, TakeOff) and self.axis.state is MotionState.MOVING

    @property
    def lands(self) -> bool:
        """The drone is descending to land."""
        return isinstance(self._motion, Land) and self.axis.state is MotionState.MOVING

    def is_flying(self, motion: Motion) -> bool:
        return self.axis.state in (*BUSY, MotionState.DONE) and motion in (self._motion, self._next)

    @property
    def target(self) -> Vector | None:
        """End of the leg being flown, for the obstacle node."""
        if self.axis.state not in (*BUSY, MotionState.BLOCKED):
            return None
        match self._legs:
            case [FlyTo(target=target), *_]:
                return target
            case [Round(), *_] if self.path is not None:
                return self.path.end
            case _:
                return None

    def way(self, t: float) -> tuple[Vector, ...]:
        """Corners of the way ahead; empty for a straight one."""
        if self.path is None or self.target is None:
            return ()
        if self._may_join or isinstance(self.path, Blend):
            corner = (self.path.corner(t),) if isinstance(self.path, Blend) else ()
            rest = (self.path.end,) if self._may_join else ()
            return *corner, *rest, self.target
        if not isinstance(self._legs[0], Round):
            return ()
        return self._legs[0].after(self._flown(t)).ahead(self.path.at(t)[0], _PUBLISHED_AHEAD)

    def laps_done(self, t: float) -> float | None:
        """Laps flown of the present orbit, or of the last one."""
        if not isinstance(self._motion, Orbit):
            return None
        left = self._legs[-1] if self._legs else None
        return self._motion.laps - (left.after(self._flown(t)).laps if isinstance(left, Round) else 0.0)

    def place(self, t: float) -> tuple[Vector, Vector, Vector]:
        """Position, velocity and acceleration at `t`; inside the fence, whatever the path."""
        assert self.path is not None
        wanted, velocity, acceleration = self.path.at(t)
        confined = self._limits.confine(wanted, landing=isinstance(self._motion, Land))
        return (wanted, velocity, acceleration) if confined == wanted else (confined, _STILL, _STILL)

    # --- commands --------------------------------------------------------------------------------------------

    def hold(self, place: Vector, t: float) -> None:
        """Hold this position, or the nearest one inside the fence."""
        place = self._limits.confine(place)
        self.path = straight(place, place, 1.0, t)

    def rest(self) -> None:
        """Drop the path on the ground, and complete a stop that is under way."""
        self.path = None
        if self.axis.state is MotionState.STOPPING:
            self.axis.become(*self._after_stop)

    def touched_down(self) -> None:
        self.path = None
        if isinstance(self._motion, Land) and self.axis.state is MotionState.MOVING:
            self.axis.remaining = 0.0
            self.axis.become(MotionState.DONE)
        elif self.has_plans:
            self.axis.become(MotionState.ABORTED, "the autopilot has landed")
        self._next = None

    def next_start(self, navigation: Navigation, t: float) -> Vector:
        """Start of the next motion: the place where the drone comes to rest."""
        if self.path is None:
            return navigation.position
        return self.path.end if self.path.is_over(t) else self.path.broken_off(t).end

    def require_in_view(self, motion: Motion, navigation: Navigation, t: float) -> None:
        """Raise CommandRefusedError for a first leg that the turned sensor could not see."""
        here = self.next_start(navigation, t)
        for leg in _legs(motion, here)[:1]:
            if isinstance(leg, FlyTo) and self._heading_of_leg(leg, here, navigation) is not None:
                self._monitor.require_in_view(here, leg.target, t)

    def start(self, motion: Motion, navigation: Navigation, t: float) -> None:
        """Begin a motion after the previous one has come to rest, or fly on to a target straight ahead.

        A flight that may join the one before begins earlier, once its way is known to be free.
        """
        if isinstance(motion, FlyTo) and self._fly_on(motion, t):
            return
        flies = self.axis.state is MotionState.MOVING and isinstance(self._motion, FlyTo)
        joins = (flies or self._may_join) and isinstance(motion, FlyTo) and motion.nose is YawMode.FREE
        self._legs = []
        if self.path is not None and not self.path.is_over(t):
            self._end_before(motion, t)
            if joins:
                self._legs = _legs(motion, self.path.end)
                self._monitor.begin(t)
            return
        self._motion, self._next = motion, None
        here = self.next_start(navigation, t)
        self._legs = _legs(motion, here)
        match motion:
            case TakeOff():
                self._heading.hold(navigation.heading)
                self._go(here, (here[0], here[1], motion.height), motion.speed, t)
            case FlyTo() | Orbit():
                self._begin_leg(here, navigation, t)
            case Land():
                self._begin_descent(motion, here, t)
            case _:
                self.axis.become(MotionState.DONE)

    def _end_before(self, motion: Motion, t: float) -> None:
        """Brake, and begin the motion at rest."""
        assert self.path is not None
        self.path = self.path.broken_off(t)
        self._legs, self._motion, self._next = [], None, motion
        self.axis.become(MotionState.STOPPING, "ending the motion before")

    @property
    def _may_join(self) -> bool:
        """The drone brakes for the next flight, which may begin before it is at rest."""
        return self._next is not None and bool(self._legs)

    def _join(self, path: Segment, t: float) -> None:
        """Begin the next flight now if that is safe.

        The corner is the place where the drone would come to rest. The way is judged for the fastest blend: it is clear
        only if the view extends beyond the corner.
        """
        leg = self._legs[0]
        assert isinstance(leg, FlyTo)
        way = subtract(leg.target, path.end)
        left = norm(way)
        if left <= ARRIVED_WITHIN:
            return
        speed = self._permitted_speed(scale(1.0 / left, way), leg.speed, t)
        blend = joined(path, straight(path.end, leg.target, speed, t))
        left += norm(subtract(path.end, path.at(t)[0]))
        if blend is not None and self._monitor.may_join(t, JOINING_SPEED, left):
            self._motion, self._next, self.path = leg, None, blend
            self._across = None
            self.axis.become(MotionState.MOVING)

    def _fly_on(self, motion: FlyTo, t: float) -> bool:
        """Go on to a target straight ahead. False if the drone has to brake first.

        The way ahead is in view, if anything looks there. Any other way has to be looked at first.
        """
        flown, path = self._motion, self.path
        if self.axis.state is not MotionState.MOVING or not isinstance(flown, FlyTo) or not isinstance(path, Segment):
            return False
        speed = self._permitted_speed(path.direction, motion.speed, t)
        further = continued(path, motion.target, speed, t) if motion.nose is flown.nose else None
        if further is None:
            return False
        self._motion, self._next, self._legs, self.path = motion, None, [motion], further
        self.axis.become(MotionState.MOVING)
        return True

    def brake(self, t: float, then: MotionState, text: str = "") -> None:
        """Brake along the path; at rest the motion's state becomes `then`."""
        if self.path is not None and not self.path.is_over(t):
            flown, self.path = self._flown(t), self.path.broken_off(t)
            if self._legs and isinstance(self._legs[0], Round):
                self._legs[0] = self._legs[0].after(flown + self.path.profile.distance)
        self._after_stop = then, text
        self._next = None
        self.axis.become(MotionState.STOPPING, text)

    def abort(self, t: float, why: str) -> None:
        """Abort the holder's motion: brake, and report ABORTED once at rest."""
        self.brake(t, MotionState.ABORTED, why)
        if self._heading.axis.goal == self.axis.goal and self._heading.axis.state is MotionState.TURNING:
            self._heading.stop(MotionState.ABORTED, why)

    # --- legs ------------------------------------------------------------------------------------------------

    def _begin_leg(self, here: Vector, navigation: Navigation, t: float) -> None:
        """Turn to the heading that the next leg needs, then fly it."""
        leg = self._legs[0]
        self._turning_since = t
        heading = self._heading_of_leg(leg, here, navigation)
        self._across = None
        if heading is not None and isinstance(leg, FlyTo):
            self._across = leg.nose is YawMode.IN_VIEW and self._monitor.looks_across
        self._monitor.begin(t, across=self._across)
        self.axis.remaining = self._left(leg, here, t) + self._later
        if heading is not None:
            self._heading.turn_to(heading, navigation.heading)
        if isinstance(leg, Round) or not (heading is None or self._heading.aligned):
            self.path = straight(here, here, 1.0, t)
            self.axis.become(MotionState.TURNING)
        else:
            self._go(here, leg.target, leg.speed, t)

    def _heading_of_leg(self, leg: Leg, here: Vector, navigation: Navigation) -> float | None:
        """The heading that a leg needs, None for any."""
        if isinstance(leg, Round):
            return leg.bearing(here) + math.pi
        way = subtract(leg.target, here)
        if leg.nose is YawMode.FREE or math.hypot(way[0], way[1]) <= 0.5:
            return None
        track = math.atan2(way[1], way[0])
        if leg.nose is YawMode.ALONG_TRACK or not self._monitor.looks_across:
            return track
        sides = (track - math.pi / 2, track + math.pi / 2)
        return min(sides, key=lambda side: abs(wrap(side - navigation.heading)))

    def _left(self, leg: Leg, place: Vector, t: float) -> float:
        """Metres from a place to the end of the present leg."""
        if isinstance(self.path, Blend) and self.axis.state is MotionState.MOVING:
            corner = self.path.corner(t)
            return norm(subtract(corner, place)) + norm(subtract(self.path.end, corner))
        return leg.length - self._flown(t) if isinstance(leg, Round) else norm(subtract(leg.target, place))

    @property
    def _later(self) -> float:
        """Metres of the legs after the present one."""
        return sum(leg.length for leg in self._legs[1:] if isinstance(leg, Round))

    def _flown(self, t: float) -> float:
        """Metres of the present round that its leg does not count yet."""
        return self.path.flown(t) if isinstance(self.path, Arc) and self.axis.state is MotionState.MOVING else 0.0

    def _begin_descent(self, landing: Land, here: Vector, t: float) -> None:
        """Descend to `FLARE_HEIGHT` above the ground if the range-finder sees it, and slowly from there."""
        ground = self._ground(t)
        if ground is not None and ground > FLARE_HEIGHT + 1.0:
            self._go(here, (here[0], here[1], here[2] - (ground - FLARE_HEIGHT)), landing.speed, t)
        else:
            self._go(here, (here[0], here[1], here[2] - _BELOW_ANY_GROUND), min(landing.speed, TOUCHDOWN_SPEED), t)

    def _ground(self, t: float) -> float | None:
        """Distance to the ground by a recent measurement of the range-finder."""
        measured, distance = self._range
        return distance if t - measured <= _RANGE_VALID else None

    def _go(self, here: Vector, target: Vector, speed: float, t: float) -> None:
        way = subtract(target, here)
        speed = self._permitted_speed(scale(1.0 / max(norm(way), 1e-9), way), speed, t)
        self._fly(straight(here, target, speed, t), t)

    def _permitted_speed(self, direction: Vector, speed: float, t: float) -> float:
        """The speed of a leg, at most as fast as a climb allows, and the view of the way."""
        climb = abs(direction[2])
        if climb > 0.0:
            speed = min(speed, MAX_CLIMB / climb)
        return min(speed, self._monitor.speed_limit(t)) if self._legs else speed

    def _fly(self, path: Path, t: float) -> None:
        self.path = path
        self._monitor.begin(t, across=self._across if self._legs else None)
        self.axis.become(MotionState.MOVING)

    # --- progress --------------------------------------------------------------------------------------------

    def advance(self, t: float, navigation: Navigation) -> None:
        """Update the motion's state at `t`."""
        if isinstance(self.path, Blend):
            self.path = self.path.joined(t)
        state, path = self.axis.state, self.path
        assert path is not None
        if state in UNDER_WAY and self._limits.has_left(navigation.position):
            self.abort(t, "the drone has left the geofence")
        elif state is MotionState.STOPPING:
            self._advance_stop(t, navigation, path)
        elif state is MotionState.TURNING:
            self._advance_turn(t, path)
        elif state is MotionState.WAITING:
            self._advance_wait(t, navigation, path)
        elif state is MotionState.MOVING:
            self._advance_path(t, navigation, path)

    def _advance_stop(self, t: float, navigation: Navigation, path: Path) -> None:
        at_rest = norm(navigation.velocity) <= AT_REST
        # In a storm the drone may never come to rest; the wait for it has to end all the same.
        overdue = t - path.began > path.profile.duration + PATIENCE
        if not path.is_over(t) or not (at_rest or overdue):
            if self._may_join and isinstance(path, Segment) and not path.is_over(t):
                self._join(path, t)
            return
        if self._next is not None:
            self.start(self._next, navigation, t)
        else:
            self.axis.become(*self._after_stop)

    def _advance_turn(self, t: float, path: Path) -> None:
        leg = self._legs[0]
        if self._heading.axis.goal != self.axis.goal:
            self.abort(t, "another goal has taken the heading")
        elif not self._heading.aligned:
            return
        elif isinstance(leg, FlyTo):
            self._go(path.end, leg.target, leg.speed, t)
        elif self._knows_enough(t):
            self._fly(leg.arc(path.end, self._monitor.speed_limit(t), t), t)

    def _knows_enough(self, t: float) -> bool:
        """Test for the start of a round: there is a report on its way, or none will come."""
        monitor = self._monitor
        return monitor.has_report(t) or t - self._turning_since > _REPORT_WAIT or not monitor.has_depth_map(t)

    def _advance_wait(self, t: float, navigation: Navigation, path: Path) -> None:
        if self._monitor.may_go_on(t):
            self._begin_leg(path.end, navigation, t)
        elif t - path.began > path.profile.duration + PATIENCE:
            self.axis.become(MotionState.BLOCKED, f"{NO_VIEW} for {PATIENCE:g} s")

    def _advance_path(self, t: float, navigation: Navigation, path: Path) -> None:
        position, velocity, _ = path.at(t)
        off = norm(subtract(position, navigation.position))
        if isinstance(self._motion, Land):
            self._advance_landing(self._motion, t, navigation, path)
            return
        left = norm(subtract(path.end, navigation.position))
        if self._legs:
            left = self._left(self._legs[0], navigation.position, t)
        self.axis.remaining = left + self._later
        if off > DRIFT:
            self.abort(t, f"the drone has drifted {off:.1f} m from its path")
        elif path.is_over(t):
            self._conclude(t, navigation, path)
        elif self._legs:
            leg = self._legs[0]
            self._check_path(t, path.stopping_speed(t) if isinstance(path, Blend) else norm(velocity), left)
            self._face_centre(leg, t, position)

    def _face_centre(self, leg: Leg, t: float, position: Vector) -> None:
        if not isinstance(leg, Round):
            return
        if self._heading.axis.goal == self.axis.goal:
            self._heading.follow(leg.bearing(position) + math.pi)
        else:
            self.abort(t, "another goal has taken the heading")

    def _check_path(self, t: float, speed: float, left: float) -> None:
        match self._monitor.view(t, speed, left):
            case PathVisibility.BLOCKED:
                self.brake(t, MotionState.BLOCKED, "an obstacle stands on the way")
            case PathVisibility.BLIND | PathVisibility.TOO_FAST if isinstance(self.path, Blend) and self._motion:
                self._end_before(self._motion, t)
            case PathVisibility.BLIND:
                self.brake(t, MotionState.WAITING, "no fresh view of the way ahead")
            case PathVisibility.TOO_FAST:
                self.brake(t, MotionState.WAITING, "the view of the way ahead has become too short for this speed")
            case PathVisibility.CLEAR | PathVisibility.UNWATCHED:
                pass

    def _advance_landing(self, landing: Land, t: float, navigation: Navigation, path: Path) -> None:
        ground = self._ground(t)
        height = ground if ground is not None else navigation.position[2]
        self.axis.remaining = max(0.0, height)
        late = navigation.position[2] - path.at(t)[0][2]
        if late > DRIFT:
            self.brake(t, MotionState.BLOCKED, "the drone does not come down")
        elif path.is_over(t):
            self._begin_descent(landing, path.end, t)

    def _conclude(self, t: float, navigation: Navigation, path: Path) -> None:
        short = norm(subtract(path.end, navigation.position))
        if short <= ARRIVED_WITHIN and norm(navigation.velocity) <= AT_REST:
            del self._legs[:1]
            if self._legs:
                self._begin_leg(path.end, navigation, t)
            else:
                self.axis.remaining = 0.0
                self.axis.become(MotionState.DONE)
        elif t - path.began > path.profile.duration + PATIENCE:
            self.axis.become(MotionState.BLOCKED, f"no headway, {short:.1f} m short of the target")


def _legs(motion: Motion, here: Vector) -> list[Leg]:
    """The monitored legs of a motion from this place."""
    match motion:
        case FlyTo():
            return [motion]
        case Orbit():
            left = Round.of(motion)
            return [FlyTo(target=left.entry(here, motion.height), speed=motion.speed, nose=YawMode.IN_VIEW), left]
        case _:
            return []
