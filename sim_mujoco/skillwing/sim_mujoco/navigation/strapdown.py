"""Inertial navigation: position, velocity and attitude from gyroscopes and accelerometers.

Strapdown equations in a local level frame (ENU), without the earth's rotation, which a small MEMS gyroscope cannot
measure. Plain floats are faster than arrays at 250 Hz.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from skillwing.onboard.frames.vectors import Quaternion, Vector, add, scale, subtract, to_world

GRAVITY = 9.81
ZERO: Vector = (0.0, 0.0, 0.0)


@dataclass(slots=True)
class Strapdown:
    """The nominal state: position and velocity ENU, attitude body to world, biases of the instruments (FLU).

    `rate` is the latest angular rate without its bias. `impulse` is the integral of the specific force in the world
    frame [m/s], and `turn` that of the angular rate [rad]. The user of the integrals sets them to zero.
    """

    position: Vector = ZERO
    velocity: Vector = ZERO
    quaternion: Quaternion = (1.0, 0.0, 0.0, 0.0)
    force_bias: Vector = ZERO
    rate_bias: Vector = ZERO
    rate: Vector = ZERO
    impulse: Vector = field(default=ZERO)
    turn: Vector = field(default=ZERO)

    def step(self, force: Vector, rate: Vector, dt: float) -> None:
        """Advance by `dt` with specific force [m/s2] and angular rate [rad/s], FLU, measured in the middle of it."""
        self.rate = subtract(rate, self.rate_bias)
        turned = scale(dt, self.rate)
        before = self.quaternion
        after = self.quaternion = rotated(before, turned)
        halfway = (
            0.5 * (before[0] + after[0]),
            0.5 * (before[1] + after[1]),
            0.5 * (before[2] + after[2]),
            0.5 * (before[3] + after[3]),
        )
        gained = scale(dt, to_world(halfway, subtract(force, self.force_bias)))
        self.impulse = add(self.impulse, gained)
        self.turn = add(self.turn, turned)
        x, y, z = self.velocity
        self.velocity = x + gained[0], y + gained[1], z + gained[2] - GRAVITY * dt
        mean = scale(0.5, add((x, y, z), self.velocity))
        self.position = add(self.position, scale(dt, mean))

    def correct(
        self, position: Vector, velocity: Vector, angles: Vector, force_bias: Vector, rate_bias: Vector
    ) -> None:
        """Add corrections; `angles` is a small rotation about the axes of the world [rad]."""
        self.position = add(self.position, position)
        self.velocity = add(self.velocity, velocity)
        w, x, y, z = self.quaternion
        a, b, c = scale(0.5, angles)
        self.quaternion = _normalised(
            w - a * x - b * y - c * z, x + a * w + b * z - c * y, y + b * w + c * x - a * z, z + c * w + a * y - b * x
        )
        self.force_bias = add(self.force_bias, force_bias)
        self.rate_bias = add(self.rate_bias, rate_bias)


def rotated(q: Quaternion, angles: Vector) -> Quaternion:
    """`q` followed by a small rotation about the axes of the body [rad]."""
    w, x, y, z = q
    a, b, c = 0.5 * angles[0], 0.5 * angles[1], 0.5 * angles[2]
    return _normalised(
        w - x * a - y * b - z * c, x + w * a + y * c - z * b, y + w * b + z * a - x * c, z + w * c + x * b - y * a
    )


def _normalised(w: float, x: float, y: float, z: float) -> Quaternion:
    """Scaled to length 1, from a length very near to it."""
    k = 1.5 - 0.5 * (w * w + x * x + y * y + z * z)
    return k * w, k * x, k * y, k * z
