"""The mapping node with odometry on a bus: what it publishes, and how it begins anew after a divergence."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from box_room import BATCH, HALF, LOW, PERIOD, Room

from skillwing.services.bus import Answered
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.protocol import Message, decode, encode
from skillwing.sim_mujoco import topics
from skillwing.sim_mujoco.mapping.node import make_mapping


class Bench:
    """The node, and a drone in the room that publishes its measurements."""

    def __init__(self) -> None:
        self.room = Room()
        self.network = InProcessNetwork()
        self.network.attach(make_mapping({"low": list(LOW), "high": [-x for x in LOW]}))
        self.bus = self.network.bus("bench")
        self.poses: list[topics.Odometry] = []
        self.states: list[topics.MappingStatus] = []
        self.bus.subscribe(
            topics.SLAM_ODOMETRY, lambda sample: self.poses.append(decode(sample.payload, topics.Odometry))
        )
        self.bus.subscribe(
            topics.MAPPING_STATUS, lambda sample: self.states.append(decode(sample.payload, topics.MappingStatus))
        )
        self._out = {key: self.bus.advertise(key) for key in (topics.NAVIGATION, topics.LIDAR, topics.IMU)}
        self._every(PERIOD, self._scan)
        self._every(BATCH, self._feel)

    def run_until(self, done: Callable[[], bool], seconds: float) -> bool:
        return self.network.run_until(done, seconds)

    def command(self, goal: str, token: int, run: bool) -> str:
        answers: list[Any] = []
        message = topics.ControlMapping(goal_id=goal, token=token, run=run)
        self.bus.ask(topics.MAPPING_COMMAND, encode(message), answers.append)
        assert self.run_until(lambda: bool(answers), 1.0)
        assert isinstance(answers[0], Answered)
        return decode(answers[0].payload, topics.Done).text

    def centres(self) -> np.ndarray:
        answers: list[Any] = []
        self.bus.ask(topics.MAP_SNAPSHOT, encode(topics.Empty()), answers.append)
        assert self.run_until(lambda: bool(answers), 1.0)
        return np.frombuffer(answers[0].payload, np.float32).reshape(-1, 3)

    def _every(self, period: float, act: Callable[[], None]) -> None:
        self.bus.every(period, act)

    def _scan(self) -> None:
        scan = self.room.scan(self.bus.now() - PERIOD, self.bus.now())
        self._put(topics.LIDAR, scan.header, scan.ranges)

    def _feel(self) -> None:
        now = self.bus.now()
        felt = self.room.inertial(now - BATCH, now)
        rows = np.column_stack([felt.times - felt.times[0], felt.forces, felt.rates]).astype(np.float32)
        self._put(topics.IMU, topics.ImuHeader(t0=float(felt.times[0]), count=len(rows)), rows)
        self._out[topics.NAVIGATION].put(encode(self.room.navigation(now)))

    def _put(self, key: str, header: Message, data: np.ndarray) -> None:
        self._out[key].put(data.tobytes(), encode(header))


def test_a_map_from_odometry_a_divergence_and_a_new_start() -> None:
    bench = Bench()
    bench.command("first", 1, True)
    assert bench.run_until(lambda: len(bench.poses) >= 20, 6.0)
    pose, status = bench.poses[-1], bench.states[-1]
    assert pose.tracking is topics.Tracking.GOOD
    assert pose.position == pytest.approx(tuple(bench.room.position(pose.t)), abs=0.05)
    assert max(pose.position_sigma) < 0.1
    assert (status.pose_source, status.diverged, status.text) == ("LiDAR-inertial odometry", False, "")
    walls = bench.centres()
    assert len(walls) > 200
    assert np.linalg.norm(walls, axis=1).max() < np.linalg.norm(HALF) + 1.0

    bench.room.lidar_bias = 1.0
    assert bench.run_until(lambda: bench.states[-1].diverged, 3.0)
    assert bench.poses[-1].tracking is topics.Tracking.LOST
    assert bench.states[-1].text
    assert len(bench.centres()) >= len(walls)
    bench.room.lidar_bias = 0.0
    bench.command("first", 1, False)
    assert bench.command("second", 2, True) == "mapping anew"
    assert len(bench.centres()) < 0.5 * len(walls)
    given = len(bench.poses)
    assert bench.run_until(lambda: len(bench.poses) >= given + 10, 6.0)
    assert not bench.states[-1].diverged
    assert bench.poses[-1].since > pose.since
    assert bench.poses[-1].position == pytest.approx(tuple(bench.room.position(bench.poses[-1].t)), abs=0.1)
