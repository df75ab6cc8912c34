"""Directions of the measurements in a picture, in a scan and of the range-finder, and the noise of depths.

Frames are FLU (x forward, y left, z up).
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from skillwing.onboard.frames.vectors import Vector
from skillwing.onboard.topics.sensors import DepthHeader

RANGE_MOUNT: Final[Vector] = (0.0, 0.0, -0.42)
"""Position of the range-finder on the drone; it looks along the body's -z [m]."""
DEPTH_NOISE: Final = 0.0015
"""Depth noise grows with the square of the depth, as disparity noise does: sigma = 0.0015 z^2 [m]."""
LIDAR_HALF_FAN: Final = math.radians(15.0)
"""Largest angle of the LiDAR's beams from the plane of its ring, fore and aft [rad]."""


@lru_cache(maxsize=2)
def lidar_directions(columns: int, beams: int) -> NDArray[np.float32]:
    """Unit directions (columns, beams, 3), read-only. The ring is orthogonal to the nose (spin axis = body x).

    Column 0 looks left, and a quarter turn later up; beam 0 is tilted aft, the last one forward.
    """
    azimuth = (np.arange(columns) * (2 * np.pi / columns))[:, None]
    elevation = np.linspace(-LIDAR_HALF_FAN, LIDAR_HALF_FAN, beams)[None, :]
    x = np.broadcast_to(np.sin(elevation), (columns, beams))
    y, z = np.cos(azimuth) * np.cos(elevation), np.sin(azimuth) * np.cos(elevation)
    directions = np.stack([x, y, z], axis=-1).astype(np.float32)
    directions.flags.writeable = False
    return directions


def depth_directions(header: DepthHeader) -> NDArray[np.float32]:
    """Directions (height, width, 3) with x = 1: a pixel's point is `mount` + its depth times its direction."""
    left = -(np.arange(header.width) + 0.5 - header.cx) / header.fx
    up = -(np.arange(header.height) + 0.5 - header.cy) / header.fy
    y, z = np.meshgrid(left, up)
    return np.stack([np.ones_like(y), y, z], axis=-1).astype(np.float32)
