"""Odometry on a benchmark flight, and its errors."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

import numpy as np

from skillwing.onboard.frames.vectors import Motion, add, subtract
from skillwing.onboard.mapping.node import BEYOND
from skillwing.onboard.odometry import so3
from skillwing.onboard.odometry.inertial import Inertial
from skillwing.onboard.odometry.matching import MakeMatcher, PlaneMatcher
from skillwing.onboard.odometry.odometry import Fix, LidarInertialOdometry
from skillwing.onboard.sensor_data.scans import LidarScan
from skillwing.onboard.topics.sensors import LidarHeader
from skillwing.services.protocol import encode
from skillwing.sim_mujoco.sensors import lidar
from skillwing.sim_mujoco.sensors.channel import Measurement
from skillwing.sim_mujoco.sensors.instruments import IMU_PERIOD
from skillwing.sim_mujoco.world.layouts.courtyard import BOUNDS


def make_odometry(make_matcher: MakeMatcher = PlaneMatcher) -> LidarInertialOdometry:
    """Odometry as the mapping process has it."""
    return LidarInertialOdometry(subtract(BOUNDS.low, BEYOND), add(BOUNDS.high, BEYOND), make_matcher=make_matcher)


def give(odometry: LidarInertialOdometry, measurement: Measurement) -> Fix | None:
    """Hand a measurement of the simulator to odometry."""
    if measurement.sensor == "lidar":
        return odometry.scan(as_scan(measurement))
    if measurement.sensor == "imu":
        rows = measurement.data.astype(np.float64)
        times = np.linspace(measurement.start, measurement.start + IMU_PERIOD * len(rows), len(rows), endpoint=False)
        return odometry.imu(Inertial(times, rows[:, :3], rows[:, 3:]))
    return None


def as_scan(measurement: Measurement) -> LidarScan:
    columns, beams = measurement.data.shape
    header = LidarHeader(
        t0=measurement.start, t1=measurement.end, columns=columns, beams=beams, mount=lidar.LIDAR_MOUNT
    )
    return LidarScan.decode(measurement.data.astype(np.float32).tobytes(), encode(header))


class TruePath:
    """True motions of the last second, for fixes, which tell of a moment that is over when they come."""

    def __init__(self) -> None:
        self._motions: deque[Motion] = deque(maxlen=50)

    def go_on(self, truth: Motion) -> None:
        """The true motion 20 ms after the one before."""
        self._motions.append(truth)

    def at(self, t: float) -> Motion:
        """The true motion at `t`, one of the times that were given."""
        return next(motion for motion in self._motions if abs(motion.t - t) < 1e-6)


def off(fix: Fix, truth: Motion) -> float:
    """Error of the position in ENU as it is given out [m]."""
    return float(np.linalg.norm(fix.levelled.position - truth.position))


def turned(fix: Fix, truth: Motion) -> float:
    """Error of the attitude as it is given out [degrees]."""
    turn = so3.matrix(np.array(truth.quaternion))
    return float(np.degrees(np.linalg.norm(so3.log(turn.T @ fix.levelled.turn))))


def drifts(fixes: Sequence[Fix], truths: Sequence[Motion]) -> np.ndarray:
    """Distances (N,) from the true path once the first poses lie on each other [m]."""
    start, origin = fixes[0].state, np.array(truths[0].position)
    turn = so3.matrix(np.array(truths[0].quaternion)) @ start.turn.T
    moved = [turn @ (fix.state.position - start.position) + origin for fix in fixes]
    return np.linalg.norm(np.array(moved) - [truth.position for truth in truths], axis=1)


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))
