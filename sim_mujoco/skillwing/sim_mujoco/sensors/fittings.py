"""Which sensors the drone has: how often and how late they measure, and what their values can be."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from skillwing.onboard.sensor_data.names import GNSS, IMU, LIDAR, RANGE, ZED
from skillwing.onboard.topics.common import LARGEST_COMPONENT
from skillwing.sim_mujoco.sensors import depth_camera, gnss, lidar
from skillwing.sim_mujoco.sensors.channel import Channel
from skillwing.sim_mujoco.sensors.corruptors import ONE, Corruption, Data
from skillwing.sim_mujoco.sensors.health import Limits
from skillwing.sim_mujoco.sensors.instruments import (
    ACCELERATION_LIMIT,
    IMU_BATCH,
    IMU_DELAY,
    RANGE_DELAY,
    RANGE_PERIOD,
    RANGE_REACH,
)
from skillwing.sim_mujoco.sensors.self_tests import Jump, Roughness, SelfTest


@dataclass(frozen=True, slots=True)
class Fitting:
    """Period and delay [s], possible values, the unit in which noise and bias are given to corrupt it and the largest
    number of them, and the tests that it can make of itself."""

    period: float
    delay: float
    limits: Limits
    unit: Data = field(default_factory=lambda: ONE)
    largest: float = LARGEST_COMPONENT
    tests: Callable[[], tuple[SelfTest, ...]] = tuple


FITTINGS = {
    ZED: Fitting(
        depth_camera.PERIOD,
        depth_camera.DELAY,
        Limits(0.2, 20.5),
        tests=lambda: (
            Roughness(lambda picture: picture[::12], depth_camera.noise_at),
            Jump(lambda picture: picture[::6, ::6], speed=5.0),
        ),
    ),
    LIDAR: Fitting(
        lidar.PERIOD,
        lidar.DELAY,
        Limits(0.3, 60.5),
        tests=lambda: (
            Roughness(lambda scan: scan.T[::4], lidar.noise_at),
            Jump(lambda scan: scan[::8], speed=2.5),
        ),
    ),
    IMU: Fitting(
        IMU_BATCH,
        IMU_DELAY,
        Limits(-ACCELERATION_LIMIT, ACCELERATION_LIMIT),
        # One unit is 1 m/s2 and 0.1 rad/s.
        np.array([1.0] * 3 + [0.1] * 3, dtype=np.float32),
    ),
    RANGE: Fitting(RANGE_PERIOD, RANGE_DELAY, Limits(0.0, RANGE_REACH + 0.5)),
    GNSS: Fitting(
        gnss.PERIOD,
        gnss.DELAY,
        Limits(-gnss.FARTHEST, gnss.FARTHEST, zero_is_none=False),
        # One unit is a metre of position; velocity and heading stay right.
        np.array([1.0] * 3 + [0.0] * 4, dtype=np.float32),
        gnss.LARGEST_ERROR,
    ),
}
SENSORS = tuple(FITTINGS)


def make_channel(sensor: str, rng: np.random.Generator) -> Channel:
    """The way out of one of the SENSORS."""
    fitting = FITTINGS[sensor]
    corruption = Corruption(rng, fitting.unit, fitting.largest)
    return Channel(sensor, fitting.period, fitting.delay, fitting.limits, corruption, fitting.tests())
