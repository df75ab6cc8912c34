"""Satellite receiver: position, velocity and heading at 10 Hz, 0.1 s late.

Two antennas give the heading, as moving-base pairs of RTK receivers do. Position errors are a slow first-order
Gauss-Markov process (multipath, atmosphere, geometry) and a little jitter. The antennas are at the body's centre,
because receivers correct for their own lever arms.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from skillwing.onboard.frames.vectors import Motion, heading_of
from skillwing.onboard.topics import common, sensors
from skillwing.services.protocol import encode
from skillwing.sim_mujoco.sensors.receivers import ReceiverClass

PERIOD, DELAY = 0.1, 0.1
FARTHEST = 10_000.0
"""Largest possible distance of a fix from the home pad [m]."""
LARGEST_ERROR = 0.1 * common.LARGEST_COMPONENT
"""Largest noise and bias of a fault [m]. Both together, and navigation that accepts them, stay within the bounds of
messages."""


class GnssReceiver:
    """A satellite receiver."""

    def __init__(self, receiver: ReceiverClass, rng: np.random.Generator) -> None:
        self._receiver, self._rng = receiver, rng
        self._spread = np.array([receiver.level, receiver.level, receiver.height])
        self._keep = math.exp(-PERIOD / receiver.correlation)
        self._wander = self._spread * rng.standard_normal(3)

    def measure(self, motion: Motion) -> NDArray[np.float32]:
        """Position (3) [m], velocity (3) [m/s], heading [rad]: (7,)."""
        draws = self._rng.standard_normal(10)
        self._wander = self._keep * self._wander + math.sqrt(1.0 - self._keep**2) * self._spread * draws[:3]
        position = motion.position + self._wander + self._receiver.jitter * draws[3:6]
        velocity = motion.velocity + self._receiver.speed * draws[6:9]
        heading = heading_of(motion.quaternion) + self._receiver.heading * draws[9]
        return np.array([*position, *velocity, heading], dtype=np.float32)


def publication(_start: float, end: float, data: NDArray[np.float32]) -> tuple[bytes, bytes]:
    """Message of a fix."""
    x, y, z, vx, vy, vz, heading = data.tolist()
    return encode(sensors.Gnss(t=end, position=(x, y, z), velocity=(vx, vy, vz), heading=heading)), b""
