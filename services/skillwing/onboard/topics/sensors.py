"""Measurements of the vehicle's sensors, and their health."""

from __future__ import annotations

from enum import StrEnum

from skillwing.onboard.topics.common import Sentence, Vector3
from skillwing.services.protocol import Label, Message, Time

RANGE = "fl/range"  # Range, 20 Hz
GNSS = "fl/gnss"  # Gnss, 10 Hz, 0.1 s late
IMU = "fl/imu"  # float32 [n, 7] rows (t - t0, acceleration 3, angular rate 3) FLU, ImuHeader, 50 Hz
LIDAR = "fl/lidar"  # float32 [columns, beams] ranges in m, 0 = no return, LidarHeader, 10 Hz
ZED_DEPTH = "fl/zed/depth"  # uint16 [height, width] mm along the optical axis, 0 = no return, DepthHeader, 15 Hz
HEALTH = "fl/health"  # Health under fl/health/<sensor>, events


def health_key(sensor: str) -> str:
    return f"{HEALTH}/{sensor}"


class Range(Message, frozen=True, kw_only=True):
    """Distance down along the body's -z; None when nothing is within reach."""

    t: Time
    distance: float | None


class Gnss(Message, frozen=True, kw_only=True):
    """A satellite fix measured at `t`: position and velocity ENU, heading from two antennas."""

    t: Time
    position: Vector3
    velocity: Vector3
    heading: float


class ImuHeader(Message, frozen=True, kw_only=True):
    t0: Time
    count: int


class LidarHeader(Message, frozen=True, kw_only=True):
    """One revolution. Column c was measured at t0 + (c + 0.5) / columns * (t1 - t0). The ring is orthogonal to the
    nose: see `lidar_directions`. `mount` is the sensor's position in FLU."""

    t0: Time
    t1: Time
    columns: int
    beams: int
    mount: Vector3


class DepthHeader(Message, frozen=True, kw_only=True):
    """Pinhole model; `mount` is the camera's position in FLU, its optical axis is the body's x."""

    t: Time
    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    mount: Vector3


class SensorStatus(StrEnum):
    UNKNOWN = "UNKNOWN"
    OK = "OK"
    FAILED = "FAILED"


class Health(Message, frozen=True, kw_only=True):
    """Result of a sensor node's self-test. `id` is unique and becomes the root of a cause chain."""

    id: Label
    t: Time
    sensor: Label
    status: SensorStatus
    reason: Sentence = ""
    cause: Label | None = None
