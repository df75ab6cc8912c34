"""Straight segments with a trapezoidal speed profile, which end at rest and can be stopped early."""

from __future__ import annotations

import math
from dataclasses import dataclass

from skillwing.onboard.frames.vectors import Vector, add, norm, scale, subtract

ACCELERATION = 0.8
"""Acceleration at both ends of a segment [m/s2]."""
STRAIGHT_WITHIN = 0.05
"""Distance from the line of a path within which a new target lies straight ahead [m]."""
BRAKING = 1.2
"""Deceleration of an early stop [m/s2]."""


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
