"""Spinning LiDAR: 16 beams, 1024 columns, 10 Hz, its ring orthogonal to the nose (the spin axis is the body's x).

Columns are measured one after the other, each from where the drone was at that moment.

Not every ray returns. What comes back of a beam from a diffuse (Lambertian) surface falls with the square of the range
and with the cosine of the incidence, and fluctuates from shot to shot (speckle, texture, dirt); what stays below the
detector's threshold is no return. The range at which half of the returns from a surface hit squarely are missing is the
sensor's reach; of 16-beam sensors makers promise 90 to 100 m on bright surfaces and 40 to 50 m on dark ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from skillwing.onboard.frames.motion import Motion
from skillwing.onboard.frames.poses import interpolate, rotations
from skillwing.onboard.frames.vectors import Vector
from skillwing.onboard.sensor_data.directions import lidar_directions
from skillwing.onboard.topics import LidarHeader
from skillwing.services.protocol import encode
from skillwing.sim_mujoco.sensors.noise import NoiseTable

if TYPE_CHECKING:
    from skillwing.sim_mujoco.world.rays import RayScene

LIDAR_MOUNT: Vector = (0.0, 0.0, -0.42)
"""Where the sensor sits on the drone, FLU [m]."""
COLUMNS, BEAMS = 1024, 16
PERIOD = 0.1
DELAY = 0.02
"""From the end of a revolution until it is handed out [s]: its last packets cross the network while the drone turns the
ones before into ranges, and nobody gets it before the driver has seen that none is missing."""
REACH, NEAREST = 60.0, 0.5
RANGE_NOISE = 0.02
FADING = 0.8
"""How much echoes fluctuate: standard deviation of the logarithm of their strength."""
_DARK = -2.6
"""A fluctuation below this many standard deviations is lost at any range: one shot in two hundred."""


def noise_at(ranges: NDArray[np.float32]) -> NDArray[np.float32]:
    """Standard deviation of what is measured at a range [m]: the same at any."""
    return np.full_like(ranges, RANGE_NOISE)


class Lidar:
    """One revolution at a time."""

    def __init__(self, rays: RayScene, rng: np.random.Generator) -> None:
        self._rays, self._noise = rays, NoiseTable(rng)
        self._directions = lidar_directions(COLUMNS, BEAMS)
        self._mount = np.array(LIDAR_MOUNT)

    def scan(self, track: Sequence[Motion], start: float, end: float) -> NDArray[np.float32]:
        """Ranges (1024, 16) [m], 0 = no return, of the revolution from `start` to `end` along the track."""
        times = start + (np.arange(COLUMNS) + 0.5) / COLUMNS * (end - start)
        positions, quaternions = interpolate(track, times)
        turn = rotations(quaternions)
        origins = positions + turn @ self._mount
        directions = np.matmul(self._directions, np.ascontiguousarray(turn.transpose(0, 2, 1), dtype=np.float32))
        ranges, squareness = self._rays.hits(
            np.repeat(origins.astype(np.float32), BEAMS, axis=0), directions.reshape(-1, 3), REACH
        )
        seen = self.returns(ranges, squareness)
        noise = np.float32(RANGE_NOISE) * self._noise.draw(len(ranges))
        return np.where(seen, ranges + noise, np.float32(0.0)).reshape(COLUMNS, BEAMS)

    def returns(self, ranges: NDArray[np.float32], squareness: NDArray[np.float32]) -> NDArray[np.bool_]:
        """Which shots come back, from surfaces at `ranges` (N,) [m] hit with this cosine of incidence (N,)."""
        fluctuation = self._noise.draw(len(ranges))
        echo = np.float32(REACH**2) * squareness * np.exp(np.float32(FADING) * fluctuation)
        return (ranges > NEAREST) & (echo > ranges * ranges) & (fluctuation > _DARK)


def publication(start: float, end: float, data: NDArray[np.float32]) -> tuple[bytes, bytes]:
    """Array and header of a revolution."""
    columns, beams = data.shape
    return data.tobytes(), encode(LidarHeader(t0=start, t1=end, columns=columns, beams=beams, mount=LIDAR_MOUNT))
