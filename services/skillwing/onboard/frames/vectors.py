"""Small vectors, quaternions, headings and motion in plain floats: at 500 Hz they are faster than arrays.

Quaternions are (w, x, y, z) and turn body coordinates (FLU) into world coordinates (ENU). Headings are radians,
counter-clockwise from east.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class Motion:
    """Motion of the body at `t`: position and velocity ENU, attitude body to world, angular rate FLU."""

    t: float
    position: Vector
    velocity: Vector
    quaternion: Quaternion
    rate: Vector


def add(a: Vector, b: Vector) -> Vector:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def subtract(a: Vector, b: Vector) -> Vector:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def scale(k: float, a: Vector) -> Vector:
    return k * a[0], k * a[1], k * a[2]


def dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def norm(a: Vector) -> float:
    return math.sqrt(dot(a, a))


def unit(a: Vector) -> Vector:
    """The direction of `a`, which must not be zero."""
    return scale(1.0 / norm(a), a)


def clamp(x: float, low: float, high: float) -> float:
    return low if x < low else high if x > high else x


def axes(q: Quaternion) -> tuple[Vector, Vector, Vector]:
    """The body's x, y and z axes in world coordinates."""
    w, x, y, z = q
    return (
        (1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)),
        (2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)),
        (2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)),
    )


def to_world(q: Quaternion, v: Vector) -> Vector:
    """`v` in body coordinates, turned into world coordinates."""
    x, y, z = axes(q)
    a, b, c = v
    return a * x[0] + b * y[0] + c * z[0], a * x[1] + b * y[1] + c * z[1], a * x[2] + b * y[2] + c * z[2]


def to_body(q: Quaternion, v: Vector) -> Vector:
    """`v` in world coordinates, turned into body coordinates."""
    x, y, z = axes(q)
    return dot(x, v), dot(y, v), dot(z, v)


def heading_of(q: Quaternion) -> float:
    """Heading of the body's x axis."""
    w, x, y, z = q
    return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def wrap(angle: float) -> float:
    """The same angle within [-pi, pi]."""
    return math.remainder(angle, 2 * math.pi)
