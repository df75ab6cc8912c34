"""The mapping node with odometry on a bus: what it publishes, its start after a divergence, and its
reaction to failed sensors."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from box_room import BATCH, HALF, LOW, PERIOD, Room

from skillwing.onboard.mapping.node import make_mapping
from skillwing.onboard.sensor_data.names import IMU, LIDAR, ZED
from skillwing.onboard.topics import common, mapping, navigation, odometry, sensors
from skillwing.services.bus import Answered, Bus
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.protocol import Message, decode, encode


class Bench:
    """The node, and a drone in the room that publishes its measurements."""

    def __init__(self) -> None:
        self.room = Room()
        self.network = InProcessNetwork()
        self._node = self._start_node()
        self.bus = self.network.bus("bench")
        self.poses: list[odometry.Odometry] = []
        self.states: list[mapping.MappingStatus] = []
        self.bus.subscribe(
            odometry.SLAM_ODOMETRY, lambda sample: self.poses.append(decode(sample.payload, odometry.Odometry))
        )
        self.bus.subscribe(
            mapping.MAPPING_STATUS, lambda sample: self.states.append(decode(sample.payload, mapping.MappingStatus))
        )
        self._out = {key: self.bus.advertise(key) for key in (navigation.NAVIGATION, sensors.LIDAR, sensors.IMU)}
        self._health = {name: self.bus.advertise(sensors.health_key(name), events=True) for name in (IMU, LIDAR, ZED)}
        self._every(PERIOD, self._scan)
        self._every(BATCH, self._feel)

    def run_until(self, done: Callable[[], bool], seconds: float) -> bool:
        return self.network.run_until(done, seconds)

    def run(self, seconds: float) -> None:
        self.network.run_for(seconds)

    def restart_node(self) -> None:
        """Let the node's process die, and start it again."""
        self._node.close()
        self._node = self._start_node()

    def tell_health(self, sensor: str, status: sensors.SensorStatus, reason: str = "") -> None:
        t = self.bus.now()
        health = sensors.Health(id=f"{sensor} at {t}", t=t, sensor=sensor, status=status, reason=reason)
        self._health[sensor].put(encode(health))

    def errors(self) -> list[float]:
        """Errors of the published poses [m]."""
        return [float(np.linalg.norm(pose.position - self.room.position(pose.t))) for pose in self.poses]

    def command(self, goal: str, token: int, run: bool) -> str:
        answers: list[Any] = []
        message = mapping.ControlMapping(goal_id=goal, token=token, run=run)
        self.bus.ask(mapping.MAPPING_COMMAND, encode(message), answers.append)
        assert self.run_until(lambda: bool(answers), 1.0)
        assert isinstance(answers[0], Answered)
        return decode(answers[0].payload, common.Done).text

    def centres(self) -> np.ndarray:
        answers: list[Any] = []
        self.bus.ask(mapping.MAP_SNAPSHOT, encode(common.Empty()), answers.append)
        assert self.run_until(lambda: bool(answers), 1.0)
        return np.frombuffer(answers[0].payload, np.float32).reshape(-1, 3)

    def _start_node(self) -> Bus:
        return self.network.attach(make_mapping({"low": list(LOW), "high": [-x for x in LOW]}))

    def _every(self, period: float, act: Callable[[], None]) -> None:
        self.bus.every(period, act)

    def _scan(self) -> None:
        scan = self.room.scan(self.bus.now() - PERIOD, self.bus.now())
        self._put(sensors.LIDAR, scan.header, scan.ranges)

    def _feel(self) -> None:
        now = self.bus.now()
        felt = self.room.inertial(now - BATCH, now)
        rows = np.column_stack([felt.times - felt.times[0], felt.forces, felt.rates]).astype(np.float32)
        self._put(sensors.IMU, sensors.ImuHeader(t0=float(felt.times[0]), count=len(rows)), rows)
        self._out[navigation.NAVIGATION].put(encode(self.room.navigation(now)))

    def _put(self, key: str, header: Message, data: np.ndarray) -> None:
        self._out[key].put(data.tobytes(), encode(header))


def test_a_map_from_odometry_a_divergence_and_a_new_start() -> None:
    bench = Bench()
    bench.command("first", 1, True)
    assert bench.run_until(lambda: len(bench.poses) >= 20, 6.0)
    pose, status = bench.poses[-1], bench.states[-1]
    assert pose.tracking is odometry.Tracking.GOOD
    assert pose.position == pytest.approx(tuple(bench.room.position(pose.t)), abs=0.05)
    assert max(pose.position_sigma) < 0.1
    assert (status.pose_source, status.diverged, status.text) == ("LiDAR-inertial odometry", False, "")
    walls = bench.centres()
    assert len(walls) > 200
    assert np.linalg.norm(walls, axis=1).max() < np.linalg.norm(HALF) + 1.0

    bench.room.lidar_bias = 1.0
    assert bench.run_until(lambda: bench.states[-1].diverged, 3.0)
    assert bench.poses[-1].tracking is odometry.Tracking.LOST
    assert bench.states[-1].text
    assert len(bench.centres()) >= len(walls)
    bench.room.lidar_bias = 0.0
    bench.command("first", 1, False)
    assert bench.command("second", 2, True) == "mapping, from an empty map"
    assert len(bench.centres()) < 0.5 * len(walls)
    given = len(bench.poses)
    assert bench.run_until(lambda: len(bench.poses) >= given + 10, 6.0)
    assert not bench.states[-1].diverged
    assert bench.poses[-1].since > pose.since
    assert bench.poses[-1].position == pytest.approx(tuple(bench.room.position(bench.poses[-1].t)), abs=0.1)


def mapping_in_flight() -> Bench:
    """A node whose map grows while the drone moves."""
    bench = Bench()
    bench.command("first", 1, True)
    bench.run(4.9)
    assert bench.poses[-1].tracking is odometry.Tracking.GOOD
    assert bench.states[-1].scans > 20
    return bench


def make_lie(room: Room, sensor: str, size: float = 1.0) -> None:
    """Increase the error of a sensor by `size` [m/s2 or m]."""
    if sensor == IMU:
        room.accel_bias = room.accel_bias + size
    else:
        room.lidar_bias += size


@pytest.mark.parametrize("sensor", [IMU, LIDAR])
@pytest.mark.parametrize("late", [-0.05, 0.15])
def test_what_a_failed_sensor_measures_is_missing_until_it_is_well_again(sensor: str, late: float) -> None:
    """The report of the failure comes a little before or after the first wrong measurements."""
    bench = mapping_in_flight()
    bench.bus.after(0.1, lambda: make_lie(bench.room, sensor))
    bench.run(0.1 + late)
    bench.tell_health(sensor, sensors.SensorStatus.FAILED, "it was frozen")
    bench.run(0.05)
    given, voxels = len(bench.poses), len(bench.centres())
    bench.run(0.33 - late)
    assert (len(bench.poses), len(bench.centres())) == (given, voxels)
    make_lie(bench.room, sensor, -1.0)
    bench.tell_health(sensor, sensors.SensorStatus.OK)
    bench.run(1.5)
    assert len(bench.poses) >= given + 10
    assert bench.poses[-1].tracking is odometry.Tracking.GOOD
    assert max(bench.errors()) < 0.05
    assert len(bench.centres()) > voxels
    assert (bench.states[-1].diverged, bench.states[-1].text) == (False, "")


@pytest.mark.parametrize(("sensor", "missing"), [(IMU, "no inertial measurements"), (LIDAR, "no scans")])
def test_a_sensor_that_stays_failed_ends_the_odometry_and_is_named(sensor: str, missing: str) -> None:
    bench = mapping_in_flight()
    bench.tell_health(sensor, sensors.SensorStatus.FAILED, "it was frozen")
    bench.run(0.2)
    assert (bench.states[-1].diverged, bench.states[-1].text) == (False, f"{sensor} is FAILED: it was frozen")
    assert bench.run_until(lambda: bench.states[-1].diverged, 2.5)
    assert bench.states[-1].text.startswith(f"{sensor} is FAILED: it was frozen; there were {missing}")


def test_a_sensor_that_odometry_does_not_ask_may_fail() -> None:
    bench = mapping_in_flight()
    bench.tell_health(ZED, sensors.SensorStatus.FAILED, "it was frozen")
    given = len(bench.poses)
    bench.run(1.0)
    assert len(bench.poses) >= given + 9
    assert bench.states[-1].text == ""


def test_a_node_that_is_started_again_hears_who_has_failed_meanwhile() -> None:
    bench = Bench()
    bench.tell_health(IMU, sensors.SensorStatus.FAILED, "it was frozen")
    bench.restart_node()
    bench.run(3.0)
    assert bench.states[-1].text.startswith("imu is FAILED: it was frozen")
    assert not bench.poses
