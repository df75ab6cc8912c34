"""Pictures of the depth camera: their size, times and noise, and the message that each becomes.

Without the camera itself: readers of the table of sensors load no compiler for its loops.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from skillwing.onboard.frames.vectors import Vector
from skillwing.onboard.sensor_data.directions import DEPTH_NOISE
from skillwing.onboard.topics.sensors import DepthHeader
from skillwing.services.protocol import encode

ZED_MOUNT: Vector = (0.3, 0.0, -0.05)
"""Position of the camera on the drone, FLU [m]."""
WIDTH, HEIGHT = 320, 180
PERIOD = 1 / 15
DELAY = 0.03
"""Time from the shutter to the delivery of a picture [s]: readout, transfer and matching."""
REACH, NEAREST = 20.0, 0.4
FOCAL = HEIGHT / 2 / math.tan(math.radians(54.0) / 2)
"""Focal length [px], the same in both directions; the optical axis passes through the image's centre."""


def depth_header(t: float) -> DepthHeader:
    """The description of a picture taken at `t`."""
    return DepthHeader(
        t=t, width=WIDTH, height=HEIGHT, fx=FOCAL, fy=FOCAL, cx=WIDTH / 2, cy=HEIGHT / 2, mount=ZED_MOUNT
    )


def publication(_start: float, end: float, data: NDArray[np.float32]) -> tuple[bytes, bytes]:
    """Picture in millimetres, and its header."""
    millimetres = np.clip(np.rint(data * 1000.0), 0, np.iinfo(np.uint16).max).astype(np.uint16)
    return millimetres.tobytes(), encode(depth_header(end))


def noise_at(depth: NDArray[np.float32]) -> NDArray[np.float32]:
    """Standard deviation of a measured depth [m]."""
    return np.float32(DEPTH_NOISE) * depth * depth
