"""Sensor data as the dashboard draws it: thinned, rounded, and in the world frame. Pure numpy."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from skillwing.onboard.topics.common import Vector3
from skillwing.onboard.topics.navigation import Navigation

DEPTH_STEP = 0.08
"""One grey level of a drawn depth image [m]."""
DEPTH_LEVELS = 255
"""The last level: as far as the camera sees, and a bit."""
GRAIN = 1 / 32
"""Drawn points are rounded to this [m]: a third of the bytes in a compressed file, and nobody can see it."""

_HEIGHTS = (0.0, 0.19, 0.38, 0.62, 1.0)
_COLOURS = ((52, 88, 148), (38, 150, 150), (110, 190, 90), (235, 200, 70), (225, 95, 60))


class Throttle:
    """Lets one sample through per `period` seconds of the samples' own time."""

    def __init__(self, period: float) -> None:
        self._period = period
        self._next = -math.inf

    def due(self, t: float) -> bool:
        if t < self._next - 1e-6:
            return False
        late = t - self._next > self._period
        self._next = (t if late else self._next) + self._period
        return True


def world_points(
    ranges: NDArray[np.float32], directions: NDArray[np.float32], mount: Vector3, pose: Navigation
) -> NDArray[np.float32]:
    """World points (n, 3) [m] of what was measured: `ranges` along `directions` (one axis more, FLU), 0 = no return.

    The drone's motion during a scan is not corrected: at 2 m/s a point is drawn at most 0.2 m off."""
    hit = ranges > 0.0
    body = directions[hit] * ranges[hit][:, None] + np.asarray(mount, np.float32)
    world = body @ rotation(pose.quaternion).T + np.asarray(pose.position, np.float32)
    return np.round(world / GRAIN).astype(np.float32) * np.float32(GRAIN)


def depth_levels(millimetres: NDArray[np.uint16]) -> NDArray[np.uint16]:
    """Half the size, and coarse enough to be packed well: level n is n * DEPTH_STEP metres, 0 is no return."""
    metres = millimetres[::2, ::2].astype(np.float32) / 1000.0
    return np.clip(np.round(metres / DEPTH_STEP), 0, DEPTH_LEVELS).astype(np.uint16)


def by_height(points: NDArray[np.float32], top: float) -> NDArray[np.uint8]:
    """Colours (n, 3) of points (n, 3): blue on the ground, over green and yellow, to red at the height `top`."""
    shares = points[:, 2] / np.float32(top)
    return np.stack([np.interp(shares, _HEIGHTS, channel) for channel in zip(*_COLOURS, strict=True)], axis=1).astype(
        np.uint8
    )


def rotation(quaternion: tuple[float, float, float, float]) -> NDArray[np.float32]:
    """Rotation matrix (3, 3), body to world, of a unit quaternion (w, x, y, z)."""
    w, x, y, z = quaternion
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ],
        dtype=np.float32,
    )
