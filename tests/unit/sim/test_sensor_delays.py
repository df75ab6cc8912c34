"""Measurements come late, and say when they were taken."""

from __future__ import annotations

import math

import numpy as np
import pytest

from skillwing.onboard.sensor_data.names import IMU, LIDAR
from skillwing.onboard.topics import sensors
from skillwing.services.bus import Sample
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.protocol import decode
from skillwing.sim_mujoco.navigation.navigator import Navigator
from skillwing.sim_mujoco.sensors.channel import Measurement
from skillwing.sim_mujoco.sensors.cross_checks import CrossChecks
from skillwing.sim_mujoco.sensors.health import SensorCondition
from skillwing.sim_mujoco.sensors.instruments import IMU_BATCH, IMU_PERIOD
from skillwing.sim_mujoco.sensors.receivers import RECEIVERS
from skillwing.sim_mujoco.sensors.table import SENSORS
from skillwing.sim_mujoco.simulator.lockstep import TICK
from skillwing.sim_mujoco.simulator.node import SLICE, make_sim
from skillwing.sim_mujoco.simulator.simulator import Simulator
from skillwing.sim_mujoco.world.world import make_world


@pytest.fixture(scope="module")
def arrivals() -> list[tuple[float, Measurement]]:
    """Measurements of a simulator within half a second, and their times."""
    simulator, come = Simulator(make_world(3)), []
    while simulator.t < 0.5:
        happened = simulator.advance(simulator.t + TICK)
        come += [(simulator.t, measurement) for measurement in happened.measurements]
    return come


@pytest.mark.parametrize("sensor", SENSORS)
def test_a_measurement_comes_its_delay_after_its_end_and_with_the_next_tick(
    arrivals: list[tuple[float, Measurement]], sensor: str
) -> None:
    late = [t - measurement.end for t, measurement in arrivals if measurement.sensor == sensor]
    assert late
    delay = SENSORS[sensor].delay
    assert delay > 0.0
    assert min(late) >= delay - 1e-6
    assert max(late) < delay + TICK - 1e-6


@pytest.mark.parametrize("sensor", SENSORS)
def test_delay_neither_loses_nor_moves_measurements(arrivals: list[tuple[float, Measurement]], sensor: str) -> None:
    ends = [measurement.end for _, measurement in arrivals if measurement.sensor == sensor]
    period = SENSORS[sensor].period
    assert ends == pytest.approx([period * (k + 1) for k in range(len(ends))], abs=TICK)
    assert ends[-1] > 0.5 - SENSORS[sensor].delay - period - TICK


def test_inertial_measurements_of_a_revolution_are_there_before_it() -> None:
    """Odometry works on a scan as soon as it has come."""
    network, covered = InProcessNetwork(), 0.0
    network.attach(make_sim({"seed": 4}))
    bus = network.bus("onlooker")
    uncovered: list[float] = []

    def on_imu(sample: Sample) -> None:
        nonlocal covered
        covered = decode(sample.attachment, sensors.ImuHeader).t0 + IMU_BATCH

    def on_scan(sample: Sample) -> None:
        header = decode(sample.attachment, sensors.LidarHeader)
        assert bus.now() - header.t1 == pytest.approx(SENSORS[LIDAR].delay, abs=SLICE - 1e-6)
        uncovered.append(header.t1 - covered)

    bus.subscribe(sensors.IMU, on_imu)
    bus.subscribe(sensors.LIDAR, on_scan)
    network.run_for(1.05)
    assert len(uncovered) == 10
    assert max(uncovered) < 1e-6


def make_checks() -> CrossChecks:
    return CrossChecks(0.1, Navigator(RECEIVERS["rtk"]))


def test_a_late_batch_is_held_against_what_the_autopilot_felt_then() -> None:
    """The drone shakes so hard that the samples of another time contradict it."""
    checks, rng = make_checks(), np.random.default_rng(1)
    felt = 9.81 + 4.0 * np.sin(2.0 * math.pi * np.arange(2000) * IMU_PERIOD / 0.05) + rng.normal(0.0, 0.06, 2000)
    per_batch, late = round(IMU_BATCH / IMU_PERIOD), round(0.012 / IMU_PERIOD)
    same_time: list[str | None] = []
    mistimed: list[str | None] = []
    other = make_checks()
    for k, force in enumerate(felt):
        t = (k + 1) * IMU_PERIOD
        for each in (checks, other):
            each.autopilot_imu(t, (0.0, 0.0, float(force), 0.0, 0.0, 0.0))
        first = k + 1 - late - per_batch
        if first < 0 or first % per_batch:
            continue
        data = np.zeros((per_batch, 6), dtype=np.float32)
        data[:, 2] = felt[first : first + per_batch]
        end = (first + per_batch) * IMU_PERIOD
        same_time.append(checks.of_imu(t, Measurement(IMU, end - IMU_BATCH, end, data), SensorCondition.OK))
        mistimed.append(other.of_imu(t, Measurement(IMU, t - IMU_BATCH, t, data), SensorCondition.OK))
    assert not any(same_time)
    assert any(mistimed)
