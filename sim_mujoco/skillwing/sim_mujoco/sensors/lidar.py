"""Spinning LiDAR: 16 beams, 1024 columns, 10 Hz, its ring orthogonal to the nose (the spin axis is the body's x).

Columns are measured one after the other, each from the position of the drone at its time.

Not every ray returns. The echo from a diffuse (Lambertian) surface falls with the square of the range and with the
cosine of the incidence. It fluctuates from shot to shot (speckle, texture, dirt). An echo below the threshold of the
detector is no return. The reach is the range at which half of the returns at a right angle are missing. Data sheets of
16-beam sensors give 90 to 100 m on bright surfaces and 40 to 50 m on dark ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from skillwing.onboard.frames.pose_history import interpolate, rotations
from skillwing.onboard.frames.vectors import Motion, Vector
from skillwing.onboard.sensor_data.directions import lidar_directions
from skillwing.onboard.topics.sensors import LidarHeader
from skillwing.services.protocol import encode
from skillwing.sim_mujoco.sensors.instruments import NoiseTable

if TYPE_CHECKING:
    from skillwing.sim_mujoco.world.rays import RayScene

LIDAR_MOUNT: Vector = (0.0, 0.0, -0.42)
"""Position of the sensor on the drone, FLU [m]."""
COLUMNS, BEAMS = 1024, 16
PERIOD = 0.1
DELAY = 0.02
"""Time from the end of a revolution to its delivery [s]. The driver converts packets while the last ones cross the
network, and delivers when it has all of them."""
REACH, NEAREST = 60.0, 0.5
RANGE_NOISE = 0.02
FADING = 0.8
"""Fluctuation of echoes: standard deviation of the logarithm of their strength."""
_DARK = -2.6
"""Standard deviations below which an echo is lost at any range: one shot in two hundred."""


def noise_at(ranges: NDArray[np.float32]) -> NDArray[np.float32]:
    """Standard deviation of a measured range [m], which is constant."""
    return np.full_like(ranges, RANGE_NOISE)


class Lidar:
    """The LiDAR in the static world; it measures one revolution at a time."""

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
        ranges, squareness = self._rays.hits(origins.astype(np.float32), directions.reshape(-1, 3), REACH)
        seen = self.returns(ranges, squareness)
        noise = np.float32(RANGE_NOISE) * self._noise.draw(len(ranges))
        return np.where(seen, ranges + noise, np.float32(0.0)).reshape(COLUMNS, BEAMS)

    def returns(self, ranges: NDArray[np.float32], squareness: NDArray[np.float32]) -> NDArray[np.bool_]:
        """Mask of shots that return, from surfaces at `ranges` (N,) [m] with this cosine of incidence (N,)."""
        fluctuation = self._noise.draw(len(ranges))
        echo = np.float32(REACH**2) * squareness * np.exp(np.float32(FADING) * fluctuation)
        return (ranges > NEAREST) & (echo > ranges * ranges) & (fluctuation > _DARK)


def publication(start: float, end: float, data: NDArray[np.float32]) -> tuple[bytes, bytes]:
    """Array and header of a revolution."""
    columns, beams = data.shape
    return data.tobytes(), encode(LidarHeader(t0=start, t1=end, columns=columns, beams=beams, mount=LIDAR_MOUNT))
