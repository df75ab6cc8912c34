"""LiDAR-inertial odometry."""

from __future__ import annotations

from enum import StrEnum

from skillwing.onboard.topics.common import Quaternion, Vector3
from skillwing.onboard.topics.processes import MAPPING, VEHICLE
from skillwing.onboard.topics.rows import stream
from skillwing.services.protocol import Message, Time
from skillwing.services.wire.channel import Channel, Duty

SLAM_ODOMETRY = "fl/slam/odometry"


class Tracking(StrEnum):
    GOOD = "GOOD"
    REJECTING = "DOUBTING"  # the last scans were rejected: the pose comes from inertial measurements alone
    LOST = "LOST"  # the pose is wrong; odometry has to be initialised again


class Odometry(Message, frozen=True, kw_only=True):
    """LiDAR-inertial odometry at `t`, the end of a scan: pose and velocity as in Navigation.

    Its frame is navigation's ENU at `since`, when odometry began; it drifts away from there. The sigmas are standard
    deviations along the world's axes [m] and about the body's [rad]. `agreement` is the share of the scan's points, 0
    to 1, that lie on known surfaces.
    """

    t: Time
    since: Time
    position: Vector3
    velocity: Vector3
    quaternion: Quaternion
    position_sigma: Vector3
    attitude_sigma: Vector3
    agreement: float
    tracking: Tracking
    text: str = ""


TOPICS: tuple[Channel, ...] = (
    stream(SLAM_ODOMETRY, Odometry, MAPPING, (VEHICLE,), Duty.SHOULD, rate=10.0, when="once it has begun"),
)
