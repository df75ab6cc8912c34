"""Measurements of the vehicle's sensors, and their health."""

from __future__ import annotations

from enum import StrEnum

from skillwing.onboard.topics.common import Sentence, Vector3
from skillwing.onboard.topics.processes import BRIDGE, GUIDANCE, MAPPING, OBSTACLES, RECORDER, VEHICLE
from skillwing.onboard.topics.rows import arrays, events, stream
from skillwing.services.protocol import Label, Message, Time
from skillwing.services.wire.channel import Channel, Duty, Each

RANGE = "fl/range"
GNSS = "fl/gnss"
IMU = "fl/imu"
LIDAR = "fl/lidar"
ZED_DEPTH = "fl/zed/depth"
HEALTH = "fl/health"


def health_key(sensor: str) -> str:
    return f"{HEALTH}/{sensor}"


class Range(Message, frozen=True, kw_only=True):
    """Distance down along the body's -z; None when nothing is within reach."""

    t: Time
    distance: float | None


class Gnss(Message, frozen=True, kw_only=True):
    """A satellite fix as it arrives, measured at `t`: position and velocity ENU, heading from two antennas.

    It is for observers. The vehicle's own navigation has used it."""

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
    """Result of a sensor node's self-test. `id` is unique, and names its timeline record. `cause` is the record of the
    fault behind it, if a simulator knows one."""

    id: Label
    t: Time
    sensor: Label
    status: SensorStatus
    reason: Sentence = ""
    cause: Label | None = None


DEPTHS = "uint16 [height, width]: depth along the optical axis in mm, 0 for no return"
RANGES = "float32 [columns, beams]: ranges in m, 0 for no return"
INERTIAL = "float32 [n, 7]: seconds since t0, acceleration [m/s2], angular rate [rad/s], FLU; 250 rows a second"
TOPICS: tuple[Channel, ...] = (
    arrays(ZED_DEPTH, DepthHeader, VEHICLE, (OBSTACLES, RECORDER), Duty.SOME, DEPTHS, rate=15.0),
    arrays(LIDAR, LidarHeader, VEHICLE, (OBSTACLES, MAPPING, RECORDER), Duty.SOME, RANGES, rate=10.0),
    arrays(IMU, ImuHeader, VEHICLE, (MAPPING,), Duty.SOME, INERTIAL, rate=50.0),
    stream(RANGE, Range, VEHICLE, (GUIDANCE, OBSTACLES), Duty.SHOULD, rate=20.0),
    stream(GNSS, Gnss, VEHICLE, (), Duty.TRIALS, rate=10.0),
    events(
        HEALTH,
        Health,
        VEHICLE,
        (GUIDANCE, BRIDGE, OBSTACLES, MAPPING, RECORDER),
        Duty.SOME,
        "at each change",
        Each.SENSOR,
    ),
)
