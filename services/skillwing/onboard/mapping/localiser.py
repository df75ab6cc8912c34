"""Localiser: poses for the map from LiDAR-inertial odometry, or for comparison from another one or navigation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np

from skillwing.onboard.frames.pose_history import PoseHistory
from skillwing.onboard.frames.vectors import Vector
from skillwing.onboard.mapping.mapper import REACH
from skillwing.onboard.odometry import so3
from skillwing.onboard.odometry.inertial import Inertial
from skillwing.onboard.odometry.matching import MakeMatcher, PlaneMatcher
from skillwing.onboard.odometry.odometry import Fix, LidarInertialOdometry, Phase
from skillwing.onboard.odometry.so3 import Floats
from skillwing.onboard.odometry.state import ATTITUDE
from skillwing.onboard.sensor_data.names import IMU, LIDAR
from skillwing.onboard.sensor_data.scans import LidarScan, PlacedPoints
from skillwing.onboard.topics import common
from skillwing.onboard.topics import odometry as odometry_topics
from skillwing.onboard.topics.navigation import Navigation

_TRACKING: Final = {
    Phase.TRACKING: odometry_topics.Tracking.GOOD,
    Phase.REJECTING: odometry_topics.Tracking.REJECTING,
    Phase.LOST: odometry_topics.Tracking.LOST,
}


@dataclass(frozen=True, slots=True)
class Placement:
    """A scan in the world frame. `points` is None if it must not be mapped; `odometry` is the message to publish."""

    points: PlacedPoints | None
    odometry: odometry_topics.Odometry | None


class Localiser(Protocol):
    """Localiser of scans: takes measurements as they come, and returns a scan once its poses are known."""

    source: str
    """Source of the poses, in words."""
    sensors: tuple[str, ...]
    """Sensors that it uses, by their names in messages of health."""

    @property
    def lost(self) -> str:
        """Reason for the loss of poses; empty without a loss."""
        ...

    @property
    def text(self) -> str:
        """Reason to wait, or a problem; empty in normal operation."""
        ...

    def restart(self) -> None:
        """Discard everything, and initialise again."""
        ...

    def navigation(self, navigation: Navigation) -> Placement | None: ...
    def imu(self, batch: Inertial) -> Placement | None: ...
    def scan(self, scan: LidarScan) -> Placement | None: ...
    def check(self, t: float) -> None:
        """Detect silent sensors at `t`."""
        ...


class ByNavigation:
    """Poses by navigation, interpolated between its solutions."""

    source = "navigation solution"
    sensors: tuple[str, ...] = (LIDAR,)
    lost = text = ""

    def __init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        self._poses = PoseHistory()
        self._waiting: LidarScan | None = None

    def navigation(self, navigation: Navigation) -> Placement | None:
        self._poses.add(navigation)
        return self._place()

    def imu(self, batch: Inertial) -> Placement | None:
        return None

    def scan(self, scan: LidarScan) -> Placement | None:
        self._waiting = scan
        return self._place()

    def check(self, t: float) -> None:
        """Do nothing: navigation itself marks invalid solutions."""

    def _place(self) -> Placement | None:
        """Place the waiting scan once the drone's pose is known up to its end."""
        scan = self._waiting
        if scan is None or not self._poses.covers(*scan.span):
            return None
        self._waiting = None
        return Placement(scan.place(self._poses, REACH), None)


class ByOdometry:
    """Poses of LiDAR-inertial odometry."""

    sensors: tuple[str, ...] = (LIDAR, IMU)

    def __init__(
        self,
        low: Vector,
        high: Vector,
        make_matcher: MakeMatcher = PlaneMatcher,
        source: str = "LiDAR-inertial odometry",
    ) -> None:
        """low, high: corners of the box that odometry maps planes in [m]."""
        self.source = source
        self._odometry = LidarInertialOdometry(low, high, make_matcher=make_matcher)

    @property
    def lost(self) -> str:
        return self._odometry.text if self._odometry.phase is Phase.LOST else ""

    @property
    def text(self) -> str:
        return self._odometry.text

    def restart(self) -> None:
        self._odometry.restart()

    def navigation(self, navigation: Navigation) -> Placement | None:
        self._odometry.navigation(navigation)
        return None

    def imu(self, batch: Inertial) -> Placement | None:
        return self._placed(self._odometry.imu(batch))

    def scan(self, scan: LidarScan) -> Placement | None:
        return self._placed(self._odometry.scan(scan))

    def check(self, t: float) -> None:
        self._odometry.check(t)

    def _placed(self, fix: Fix | None) -> Placement | None:
        if fix is None:
            return None
        return Placement(fix.placed(REACH) if fix.accepted else None, self._message(fix))

    def _message(self, fix: Fix) -> odometry_topics.Odometry:
        odometry, state = self._odometry, fix.levelled
        assert odometry.begun_at is not None
        return odometry_topics.Odometry(
            t=fix.t,
            since=odometry.begun_at,
            position=_vector(state.position),
            velocity=_vector(state.velocity),
            quaternion=so3.quaternion(state.turn),
            position_sigma=_vector(fix.position_sigma),
            attitude_sigma=_vector(np.sqrt(np.diag(fix.covariance)[ATTITUDE])),
            agreement=fix.agreement.share,
            tracking=_TRACKING[odometry.phase],
            text=odometry.text,
        )


def _vector(values: Floats) -> common.Vector3:
    """Three numbers for a message, clipped to its bounds."""
    x, y, z = np.clip(values, -common.LARGEST_COMPONENT, common.LARGEST_COMPONENT).tolist()
    return x, y, z
