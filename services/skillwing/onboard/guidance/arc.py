"""Level circles around a place, flown counter-clockwise with the speed profile of a segment."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from skillwing.onboard.frames.vectors import Vector
from skillwing.onboard.guidance.heading_control import TURN_RATE
from skillwing.onboard.guidance.trajectory import Profile, braking, trapezoid
from skillwing.onboard.topics.guidance import Orbit

MAX_CENTRIPETAL = 1.0
"""Acceleration towards the centre: with the tangential one it leaves the autopilot room against gusts [m/s2]."""
_TURNING_SHARE = 0.8
"""Share of the turn rate that an orbit may need, so that the nose can catch up."""
_CHORD = 1.0
"""Longest chord of a way along the circle, in the status [m]."""


@dataclass(frozen=True, slots=True)
class Arc:
    """A flight along the circle of `radius` around `center` (x, y) at the height z, from `bearing`.

    `bearing` is seen from the centre, in radians counter-clockwise from east. `began` is its start in robot time.
    """

    center: tuple[float, float]
    radius: float
    z: float
    bearing: float
    profile: Profile
    began: float

    @property
    def end(self) -> Vector:
        return _on_circle(self.center, self.radius, self.z, self.bearing + self.profile.distance / self.radius)

    def at(self, t: float) -> tuple[Vector, Vector, Vector]:
        """Position, velocity and acceleration at robot time `t`."""
        s, v, a = self.profile.at(t - self.began)
        angle, inward = self.bearing + s / self.radius, v * v / self.radius
        c, d = math.cos(angle), math.sin(angle)
        return (
            _on_circle(self.center, self.radius, self.z, angle),
            (-v * d, v * c, 0.0),
            (-a * d - inward * c, a * c - inward * d, 0.0),
        )

    def is_over(self, t: float) -> bool:
        return t - self.began >= self.profile.duration

    def broken_off(self, t: float) -> Arc:
        """The arc that continues this one at `t` without a jump, and brakes to a stop."""
        s, v, _ = self.profile.at(t - self.began)
        return replace(self, bearing=self.bearing + s / self.radius, profile=braking(v), began=t)

    def flown(self, t: float) -> float:
        """Metres flown of this arc at `t`."""
        return self.profile.at(t - self.began)[0]


@dataclass(frozen=True, slots=True)
class Round:
    """Rest of an orbit for a drone on its circle: `laps` with the nose to the centre."""

    center: tuple[float, float]
    radius: float
    laps: float
    speed: float

    @staticmethod
    def of(orbit: Orbit) -> Round:
        return Round((orbit.center[0], orbit.center[1]), orbit.radius, orbit.laps, orbit.speed)

    @property
    def length(self) -> float:
        return 2.0 * math.pi * self.radius * self.laps

    def after(self, flown: float) -> Round:
        """The rest after `flown` metres."""
        return replace(self, laps=max(0.0, self.laps - flown / (2.0 * math.pi * self.radius)))

    def bearing(self, place: Vector) -> float:
        """Bearing of a place, seen from the centre; east for the centre itself."""
        return math.atan2(place[1] - self.center[1], place[0] - self.center[0])

    def entry(self, place: Vector, height: float) -> Vector:
        """The point of the circle that is nearest to a place."""
        return _on_circle(self.center, self.radius, height, self.bearing(place))

    def arc(self, start: Vector, speed: float, t: float) -> Arc:
        """The arc from rest at `start`, a place on the circle, to rest at the end; it begins at `t`."""
        profile = trapezoid(self.length, min(speed, self.speed, fastest_around(self.radius)))
        return Arc(self.center, self.radius, start[2], self.bearing(start), profile, t)

    def ahead(self, place: Vector, reach: float) -> tuple[Vector, ...]:
        """Corners of the next `reach` metres from a place on the circle, a third of a turn at most."""
        length = min(reach, self.length, 2.0 * math.pi / 3.0 * self.radius)
        corners = max(1, math.ceil(length / min(_CHORD, 0.3 * self.radius)))
        start, step = self.bearing(place), length / corners / self.radius
        return tuple(_on_circle(self.center, self.radius, place[2], start + k * step) for k in range(1, corners + 1))


def fastest_around(radius: float) -> float:
    """Highest speed on a circle of this radius with the nose to the centre [m/s]."""
    return min(math.sqrt(MAX_CENTRIPETAL * radius), _TURNING_SHARE * TURN_RATE * radius)


def rim(orbit: Orbit) -> tuple[Vector, ...]:
    """The four outermost points of an orbit: a box that holds them holds all of it."""
    (x, y, _), r, z = orbit.center, orbit.radius, orbit.height
    return (x + r, y, z), (x, y + r, z), (x - r, y, z), (x, y - r, z)


def _on_circle(center: tuple[float, float], radius: float, z: float, bearing: float) -> Vector:
    return center[0] + radius * math.cos(bearing), center[1] + radius * math.sin(bearing), z
