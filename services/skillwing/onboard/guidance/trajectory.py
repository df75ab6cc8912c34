"""Straight segments with a trapezoidal speed profile, which end at rest and can be stopped early."""

from __future__ import annotations

import math
from dataclasses import dataclass

from skillwing.onboard.frames.vectors import Vector, add, dot, norm, scale, subtract

ACCELERATION = 0.8
"""Acceleration at both ends of a segment [m/s2]."""
STRAIGHT_WITHIN = 0.05
"""Distance from the line of a path within which a new target lies straight ahead [m]."""
BRAKING = 1.2
"""Deceleration of an early stop [m/s2]."""
JOINING_SPEED = 1.5
"""Speed of a braking drone below which its next leg may begin [m/s]. It cuts the corner by 0.25 m at most."""
WIDEST_TURN = math.radians(100.0)
"""Largest angle between two joined legs [rad]. Up to it the drone keeps half of its speed, and both accelerations
together are no larger than in the early stop of an orbit."""


@dataclass(frozen=True, slots=True)
class Profile:
    """Distance and speed over time: phases of constant acceleration as (duration, acceleration), ending at rest."""

    speed: float
    phases: tuple[tuple[float, float], ...]

    @property
    def duration(self) -> float:
        return sum(duration for duration, _ in self.phases)

    @property
    def distance(self) -> float:
        """Total distance [m]."""
        return self.at(math.inf)[0]

    def at(self, t: float) -> tuple[float, float, float]:
        """Distance [m], speed [m/s] and acceleration [m/s2] after `t` seconds; at rest at the end afterwards."""
        s, v, left = 0.0, self.speed, max(t, 0.0)
        for duration, acceleration in self.phases:
            dt = min(left, duration)
            s += v * dt + 0.5 * acceleration * dt * dt
            v += acceleration * dt
            left -= dt
            if left <= 0.0:
                return s, v, acceleration
        return s, 0.0, 0.0


def trapezoid(distance: float, speed: float, acceleration: float = ACCELERATION) -> Profile:
    """Profile from rest to rest over `distance`, at most at `speed`; a triangle if the distance is too short for it."""
    top = min(speed, math.sqrt(distance * acceleration))
    if top <= 0.0:
        return Profile(0.0, ())
    ramp = top / acceleration
    cruise = (distance - top * ramp) / top
    return Profile(0.0, ((ramp, acceleration), (max(cruise, 0.0), 0.0), (ramp, -acceleration)))


def onward(initial: float, distance: float, speed: float) -> Profile | None:
    """Profile from the speed `initial` to rest over `distance`, at most at `speed`; None if it is too short for that.

    A slower `speed` is reached with the deceleration of an early stop.
    """
    if distance < initial * initial / (2.0 * ACCELERATION):
        return None
    if initial > speed:
        change, rate = (initial - speed) / BRAKING, -BRAKING
        top = speed
    else:
        top = min(speed, math.sqrt(ACCELERATION * distance + 0.5 * initial * initial))
        change, rate = (top - initial) / ACCELERATION, ACCELERATION
    ramp = top / ACCELERATION
    cruise = (distance - 0.5 * (initial + top) * change - 0.5 * top * ramp) / top
    return Profile(initial, ((change, rate), (max(cruise, 0.0), 0.0), (ramp, -ACCELERATION)))


def braking(speed: float) -> Profile:
    """Profile from `speed` to rest at constant deceleration."""
    return Profile(speed, ((speed / BRAKING, -BRAKING),))


@dataclass(frozen=True, slots=True)
class Segment:
    """A straight flight from `start` along `direction` (a unit vector) that began at `began` (robot time)."""

    start: Vector
    direction: Vector
    profile: Profile
    began: float

    @property
    def end(self) -> Vector:
        return add(self.start, scale(self.profile.distance, self.direction))

    def at(self, t: float) -> tuple[Vector, Vector, Vector]:
        """Position, velocity and acceleration at robot time `t`."""
        s, v, a = self.profile.at(t - self.began)
        return add(self.start, scale(s, self.direction)), scale(v, self.direction), scale(a, self.direction)

    def is_over(self, t: float) -> bool:
        return t - self.began >= self.profile.duration

    def broken_off(self, t: float) -> Segment:
        """The segment that continues this one at `t` without a jump, and brakes to a stop."""
        position, velocity, _ = self.at(t)
        return Segment(position, self.direction, braking(norm(velocity)), t)


@dataclass(frozen=True, slots=True)
class Blend:
    """A braking flight, and the next one from its end, which begins before the drone has come to rest.

    The velocity is the sum of both. So the drone cuts the corner, and stays inside the triangle of both legs.
    """

    braking: Segment
    onward: Segment

    @property
    def began(self) -> float:
        return self.onward.began

    @property
    def profile(self) -> Profile:
        """The profile along the next leg."""
        return self.onward.profile

    @property
    def end(self) -> Vector:
        return self.onward.end

    def at(self, t: float) -> tuple[Vector, Vector, Vector]:
        """Position, velocity and acceleration at robot time `t`."""
        (p1, v1, a1), (p2, v2, a2) = self.braking.at(t), self.onward.at(t)
        return add(p2, subtract(p1, self.braking.end)), add(v1, v2), add(a1, a2)

    def is_over(self, t: float) -> bool:
        return self.braking.is_over(t) and self.onward.is_over(t)

    def broken_off(self, t: float) -> Blend:
        """The blend that continues this one at `t` without a jump, and ends at rest on the next leg.

        The next leg brakes after the one before: both at once would decelerate the drone too much.
        """
        place, velocity, _ = self.onward.at(t)
        speed, wait = norm(velocity), max(0.0, self.braking.began + self.braking.profile.duration - t)
        profile = Profile(speed, ((wait, 0.0), *braking(speed).phases))
        return Blend(self.braking, Segment(place, self.onward.direction, profile, t))

    def joined(self, t: float) -> Blend | Segment:
        """The next leg alone, once the one before has come to its end."""
        return self.onward if self.braking.is_over(t) else self

    def corner(self, t: float) -> Vector:
        """Corner of the way ahead: straight to it along the leg before, then along the next one."""
        return self.onward.at(t)[0]

    def stopping_speed(self, t: float) -> float:
        """Speed of a straight flight with the same stopping distance as along this way, over its corner."""
        return norm(self.braking.at(t)[1]) + norm(self.onward.at(t)[1])


def joined(path: Segment, onward: Segment) -> Blend | None:
    """The braking `path` and the leg from its end as one flight, from the start of that leg on.

    None if the drone is still too fast, or has to turn too far: at 180 degrees it cannot but come to rest. The next leg
    also has to be so long that its end brakes the drone only after the corner.
    """
    left = path.began + path.profile.duration - onward.began
    brakes_after = onward.profile.duration - onward.profile.phases[-1][0]
    slow = norm(path.at(onward.began)[1]) <= JOINING_SPEED
    ahead = dot(path.direction, onward.direction) >= math.cos(WIDEST_TURN)
    return Blend(path, onward) if slow and ahead and brakes_after >= left else None


def continued(path: Segment, target: Vector, speed: float, t: float) -> Segment | None:
    """The segment that goes on from `path` at `t` to rest at `target`, without a stop.

    None unless the target lies straight ahead, far enough to brake as usual.
    """
    here, velocity, _ = path.at(t)
    way = subtract(target, here)
    distance = norm(way)
    aside = norm(subtract(way, scale(distance, path.direction)))
    profile = onward(norm(velocity), distance, speed) if distance > 0.0 and aside <= STRAIGHT_WITHIN else None
    return None if profile is None else Segment(here, scale(1.0 / distance, way), profile, t)


def straight(start: Vector, target: Vector, speed: float, t: float) -> Segment:
    """The segment from rest at `start` to rest at `target`, beginning at `t`."""
    way = subtract(target, start)
    distance = norm(way)
    direction = scale(1.0 / distance, way) if distance > 1e-9 else (1.0, 0.0, 0.0)
    return Segment(start, direction, trapezoid(distance, speed), t)
