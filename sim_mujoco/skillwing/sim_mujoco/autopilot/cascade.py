"""The control cascade: velocity to acceleration, attitude, body rates, rotor thrusts.

Gains were found by step responses of this airframe (t90 of a 10 m step at 3 m/s: 3.5 s, no overshoot). Higher position
gain or lower velocity gain overshoots.
"""

from __future__ import annotations

import math

from skillwing.onboard.frames.vectors import (
    Quaternion,
    Vector,
    add,
    axes,
    clamp,
    cross,
    dot,
    heading_of,
    scale,
    subtract,
    unit,
)
from skillwing.sim_mujoco.autopilot.mixer import Mixer
from skillwing.sim_mujoco.physics.hexacopter import Airframe

GRAVITY = 9.81
_POSITION_GAIN, _VELOCITY_GAIN, _VELOCITY_INTEGRAL = 1.0, 2.2, 0.5
_MAX_TILT, _MAX_TILT_WITHOUT_A_ROTOR = math.radians(25), math.radians(12)
_MAX_SPEED, _MAX_CLIMB, _MAX_CLIMB_ACCELERATION = 6.0, 2.0, 5.0
_APPROACH_BRAKING = 2.5
"""Planned braking towards a target [m/s2]."""
_LINEAR_WITHIN = _APPROACH_BRAKING / _POSITION_GAIN**2


def position_to_velocity(position: Vector, target: Vector, feed_forward: Vector) -> Vector:
    """Velocity that leads to `target` [m/s], with limits in the plane and in height.

    It grows with the distance; beyond 2.5 m only as far as the drone can brake again.
    """
    away = subtract(target, position)
    far = math.hypot(away[0], away[1])
    gain = _POSITION_GAIN
    if far > _LINEAR_WITHIN:
        gain = math.sqrt(2.0 * _APPROACH_BRAKING * (far - 0.5 * _LINEAR_WITHIN)) / far
    x, y, z = add((gain * away[0], gain * away[1], _POSITION_GAIN * away[2]), feed_forward)
    shrink = min(1.0, _MAX_SPEED / max(math.hypot(x, y), 1e-9))
    return x * shrink, y * shrink, clamp(z, -_MAX_CLIMB, _MAX_CLIMB)


class VelocityLoop:
    """Velocity error to wanted acceleration, with an integrator that is frozen while the tilt saturates."""

    def __init__(self) -> None:
        self._integral: Vector = (0.0, 0.0, 0.0)
        self._max_tilt = _MAX_TILT

    def reset(self) -> None:
        self._integral = (0.0, 0.0, 0.0)

    def limit_tilt(self) -> None:
        """Limit the tilt from now on, because four rotors carry the drone."""
        self._max_tilt = _MAX_TILT_WITHOUT_A_ROTOR

    def acceleration(self, velocity: Vector, wanted: Vector, feed_forward: Vector, dt: float) -> Vector:
        """Acceleration [m/s2] that leads to the wanted velocity within `dt`-spaced calls."""
        error = subtract(wanted, velocity)
        x, y, z = add(add(scale(_VELOCITY_GAIN, error), self._integral), feed_forward)
        level, limit = math.hypot(x, y), GRAVITY * math.tan(self._max_tilt)
        saturated = level > limit
        if saturated:
            x, y = x * limit / level, y * limit / level
        grown = [clamp(i + _VELOCITY_INTEGRAL * e * dt, -2.5, 2.5) for i, e in zip(self._integral, error, strict=True)]
        if saturated:
            grown[:2] = self._integral[:2]
        self._integral = (grown[0], grown[1], grown[2])
        return x, y, clamp(z, -_MAX_CLIMB_ACCELERATION, _MAX_CLIMB_ACCELERATION)


class AttitudeLoop:
    """Wanted acceleration and heading to rotor thrusts, at two rates: `aim` slowly, `thrusts` at every step."""

    def __init__(self, airframe: Airframe, dt: float) -> None:
        self._airframe = airframe
        self._dt = dt
        self._mixer = Mixer(airframe)
        self._axes: tuple[Vector, Vector, Vector] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
        self._thrust = airframe.mass * GRAVITY
        self._integral = [0.0, 0.0, 0.0]

    def reset(self) -> None:
        self._integral = [0.0, 0.0, 0.0]

    @property
    def holds_heading(self) -> bool:
        """False from the loss of a rotor on: then nothing controls the heading."""
        return self._mixer.lost is None

    def drop(self, rotor: int) -> None:
        """Fly without this rotor (0 to 5) from now on."""
        self._mixer.drop(rotor)
        self.reset()

    def aim(self, acceleration: Vector, heading: float, quaternion: Quaternion) -> None:
        """Choose the wanted body axes: z along the acceleration, x towards the heading if that is controlled."""
        if not self.holds_heading:
            heading = heading_of(quaternion)
        force = add(acceleration, (0.0, 0.0, GRAVITY))
        z = unit(force)
        y = unit(cross(z, (math.cos(heading), math.sin(heading), 0.0)))
        self._axes = (cross(y, z), y, z)
        weight = self._airframe.mass * GRAVITY
        self._thrust = max(0.2 * weight, self._airframe.mass * dot(force, axes(quaternion)[2]))

    def thrusts(self, quaternion: Quaternion, rate: Vector) -> list[float]:
        """Rotor thrusts (6) [N] for this attitude and angular rate (FLU)."""
        return self._mixer.thrusts(self._thrust, self._torque(self._wanted_rate(quaternion), rate))

    def _wanted_rate(self, quaternion: Quaternion) -> Vector:
        # Half the sum of the cross products of actual and wanted axes, in body coordinates.
        x, y, z = axes(quaternion)
        to_x, to_y, to_z = self._axes
        roll = 0.5 * (dot(to_y, z) - dot(to_z, y))
        pitch = 0.5 * (dot(to_z, x) - dot(to_x, z))
        yaw = 0.5 * (dot(to_x, y) - dot(to_y, x))
        turn = clamp(2.0 * yaw, -0.8, 0.8) if self.holds_heading else 0.0
        return clamp(5.0 * roll, -2.0, 2.0), clamp(5.0 * pitch, -2.0, 2.0), turn

    def _torque(self, wanted: Vector, rate: Vector) -> Vector:
        ix, iy, iz = self._airframe.inertia
        angular = [0.0, 0.0, 0.0]
        for i, gain in enumerate((11.0, 11.0, 5.0)):
            error = wanted[i] - rate[i]
            self._integral[i] = clamp(self._integral[i] + 3.0 * error * self._dt, -2.0, 2.0)
            angular[i] = gain * error + self._integral[i]
        if not self.holds_heading:
            self._integral[2] = 0.0
        p, q, r = rate
        return ix * angular[0] + (iz - iy) * q * r, iy * angular[1] + (ix - iz) * r * p, iz * angular[2]
