"""Straight segments with a trapezoidal speed profile, which end at rest and can be stopped early."""

from __future__ import annotations

import math
from dataclasses import dataclass

from skillwing.onboard.frames.vectors import Vector, add, norm, scale, subtract

ACCELERATION = 0.8
"""Acceleration at both ends of a segment [m/s2]."""
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


def straight(start: Vector, target: Vector, speed: float, t: float) -> Segment:
    """The segment from rest at `start` to rest at `target`, beginning at `t`."""
    way = subtract(target, start)
    distance = norm(way)
    direction = scale(1.0 / distance, way) if distance > 1e-9 else (1.0, 0.0, 0.0)
    return Segment(start, direction, trapezoid(distance, speed), t)
