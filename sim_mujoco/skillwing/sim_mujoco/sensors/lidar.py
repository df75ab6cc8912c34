"""Spinning LiDAR: 16 beams, 1024 columns, 10 Hz, its ring orthogonal to the nose (the spin axis is the body's x).

Columns are measured one after the other, each from where the drone was at that moment.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from skillwing.sim_mujoco.frames.motion import Motion
from skillwing.sim_mujoco.frames.poses import interpolate, rotations
from skillwing.sim_mujoco.frames.vectors import Vector
from skillwing.sim_mujoco.sensors.directions import lidar_directions
from skillwing.sim_mujoco.sensors.noise import NoiseTable
from skillwing.sim_mujoco.sensors.rays import RayScene

LIDAR_MOUNT: Vector = (0.0, 0.0, -0.42)
"""Where the sensor sits on the drone, FLU [m]."""
COLUMNS, BEAMS = 1024, 16
PERIOD = 0.1
REACH, NEAREST = 60.0, 0.5
RANGE_NOISE = 0.02


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
        directions = np.matmul(self._directions, turn.transpose(0, 2, 1).astype(np.float32))
        ranges = self._rays.distances(
            np.repeat(origins.astype(np.float32), BEAMS, axis=0), directions.reshape(-1, 3), REACH
        )
        seen = ranges > NEAREST
        noise = np.float32(RANGE_NOISE) * self._noise.draw(len(ranges))
        return np.where(seen, ranges + noise, np.float32(0.0)).reshape(COLUMNS, BEAMS)
