"""The table of sensors: one row each. Simulator, health, faults and publications follow from it.

Nothing here loads physics, the ray caster or the compiler, so that scenario files can be checked without them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from skillwing.onboard.frames.vectors import Motion
from skillwing.onboard.sensor_data.names import GNSS, IMU, LIDAR, RANGE, ZED
from skillwing.onboard.topics import common, sensors
from skillwing.sim_mujoco.sensors import depth_pictures, gnss, instruments, lidar
from skillwing.sim_mujoco.sensors.channel import Observer, SensorChannel, no_residual
from skillwing.sim_mujoco.sensors.corruptors import ONE, Corruption, Data
from skillwing.sim_mujoco.sensors.cross_checks import CrossChecks
from skillwing.sim_mujoco.sensors.health import Limits
from skillwing.sim_mujoco.sensors.receivers import ReceiverClass
from skillwing.sim_mujoco.sensors.self_tests import Jump, Roughness, SelfTest

if TYPE_CHECKING:
    from skillwing.sim_mujoco.sensors.depth_camera import DepthCamera
    from skillwing.sim_mujoco.world.rays import RayScene

Publication: TypeAlias = tuple[bytes, bytes]
"""Payload and attachment."""


@dataclass(frozen=True, slots=True)
class Surroundings:
    """Parts that sensors are made with: the world for rays, and the class of the satellite receiver."""

    rays: RayScene
    receiver: ReceiverClass


@dataclass(frozen=True, slots=True)
class Moment:
    """The truth at time `t` [s]: motion of the last 0.1 s, one entry each tick, and the last inertial samples (6)."""

    t: float
    track: Sequence[Motion]
    inertial: Sequence[tuple[float, ...]]

    @property
    def motion(self) -> Motion:
        return self.track[-1]


def _now(moment: Moment) -> float:
    return moment.t


@dataclass(frozen=True, slots=True)
class SensorSpec:
    """A sensor of the drone.

    topic: key of its publications. period: time between measurements [s]. delay: from end to arrival of one [s].
    limits: values that it can produce.
    make: makes the instrument, from the surroundings and random numbers of its own.
    measure: takes the data of a moment with the instrument.
    message: makes a publication from start and end of a measurement (robot time) and its data.
    start: begin of the measurement that ends at a moment; by default both are the same.
    unit, largest: the unit in which noise and bias of its faults are given, and the largest number of them.
    self_tests: tests that it makes of its own data. observer: the cross-check by other instruments.
    """

    name: str
    topic: str
    period: float
    delay: float
    limits: Limits
    make: Callable[[Surroundings, np.random.Generator], Any]
    measure: Callable[[Any, Moment], Data]
    message: Callable[[float, float, Data], Publication]
    start: Callable[[Moment], float] = _now
    unit: Data = field(default_factory=lambda: ONE)
    largest: float = common.LARGEST_COMPONENT
    self_tests: Callable[[], tuple[SelfTest, ...]] = tuple
    observer: Callable[[CrossChecks], Observer] = lambda _: no_residual

    def channel(self, rng: np.random.Generator, checks: CrossChecks) -> SensorChannel:
        """A channel from this sensor to its readers."""
        corruption = Corruption(rng, self.unit, self.largest)
        tests, observer = self.self_tests(), self.observer(checks)
        return SensorChannel(self.name, self.period, self.delay, self.limits, corruption, tests, observer)


def _make_depth_camera(surroundings: Surroundings, rng: np.random.Generator) -> DepthCamera:
    from skillwing.sim_mujoco.sensors.depth_camera import DepthCamera  # noqa: PLC0415 - loads the compiler

    return DepthCamera(surroundings.rays, rng)


_ROWS = (
    SensorSpec(
        ZED,
        sensors.ZED_DEPTH,
        depth_pictures.PERIOD,
        depth_pictures.DELAY,
        Limits(0.2, 20.5),
        make=_make_depth_camera,
        measure=lambda camera, moment: camera.picture(moment.motion),
        message=depth_pictures.publication,
        self_tests=lambda: (
            Roughness(lambda picture: picture[::12], depth_pictures.noise_at),
            Jump(lambda picture: picture[::6, ::6], speed=5.0),
        ),
    ),
    SensorSpec(
        LIDAR,
        sensors.LIDAR,
        lidar.PERIOD,
        lidar.DELAY,
        Limits(0.3, 60.5),
        make=lambda surroundings, rng: lidar.Lidar(surroundings.rays, rng),
        measure=lambda scanner, moment: scanner.scan(moment.track, moment.track[0].t, moment.t),
        start=lambda moment: moment.track[0].t,
        message=lidar.publication,
        self_tests=lambda: (
            Roughness(lambda scan: scan.T[::4], lidar.noise_at),
            Jump(lambda scan: scan[::8], speed=2.5),
        ),
        observer=lambda checks: checks.of_lidar,
    ),
    SensorSpec(
        IMU,
        sensors.IMU,
        instruments.IMU_BATCH,
        instruments.IMU_DELAY,
        Limits(-instruments.ACCELERATION_LIMIT, instruments.ACCELERATION_LIMIT),
        make=lambda _, rng: instruments.Imu(rng),
        measure=lambda imu, moment: imu.measure(np.array(moment.inertial)),
        start=lambda moment: moment.t - instruments.IMU_BATCH,
        message=instruments.imu_publication,
        # One unit is 1 m/s2 and 0.1 rad/s.
        unit=np.array([1.0] * 3 + [0.1] * 3, dtype=np.float32),
        observer=lambda checks: checks.of_imu,
    ),
    SensorSpec(
        RANGE,
        sensors.RANGE,
        instruments.RANGE_PERIOD,
        instruments.RANGE_DELAY,
        Limits(0.0, instruments.RANGE_REACH + 0.5),
        make=lambda surroundings, rng: instruments.RangeFinder(surroundings.rays, rng),
        measure=lambda finder, moment: finder.measure(moment.motion),
        message=instruments.range_publication,
        observer=lambda checks: checks.of_range,
    ),
    SensorSpec(
        GNSS,
        sensors.GNSS,
        gnss.PERIOD,
        gnss.DELAY,
        Limits(-gnss.FARTHEST, gnss.FARTHEST, zero_is_none=False),
        make=lambda surroundings, rng: gnss.GnssReceiver(surroundings.receiver, rng),
        measure=lambda receiver, moment: receiver.measure(moment.motion),
        message=gnss.publication,
        # One unit is a metre of position; velocity and heading stay right.
        unit=np.array([1.0] * 3 + [0.0] * 4, dtype=np.float32),
        largest=gnss.LARGEST_ERROR,
        observer=lambda checks: checks.of_gnss,
    ),
)
"""The number of a row gives its random numbers, so new rows come last."""
SENSORS = {spec.name: spec for spec in _ROWS}
