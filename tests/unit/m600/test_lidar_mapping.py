"""The manager of `lidar_mapping`."""

from __future__ import annotations

import pytest
from robot_rig import RobotRig

from skillwing.services.protocol import Ending
from skillwing.sim_mujoco.topics import SensorStatus


@pytest.fixture
def rig() -> RobotRig:
    return RobotRig("lidar_mapping", height=5.0)


def test_runs_until_it_is_interrupted(rig: RobotRig) -> None:
    goal = rig.start("lidar_mapping")
    rig.run(20.0)
    assert not goal.done
    assert rig.layer.mapping
    assert goal.progress == {"voxels": 10}
    assert rig.interface.state("slam_status") == "RUNNING"
    assert rig.interrupt(goal).label == "IT"
    assert not rig.layer.mapping
    assert rig.interface.state("slam_status") == "IDLE"


def test_a_diverged_map_ends_it(rig: RobotRig) -> None:
    goal = rig.start("lidar_mapping")
    rig.run(5.0)
    rig.layer.diverged = True
    assert rig.end(goal, within=2.0).label == "S_DIVERGED"
    assert not rig.layer.mapping


def test_a_failing_lidar_ends_it_and_stops_the_mapping(rig: RobotRig) -> None:
    goal = rig.start("lidar_mapping")
    rig.layer.report_health("lidar", SensorStatus.FAILED, "health-1")
    assert rig.end(goal, within=0.1).invariant == "lidar_ok"
    assert not rig.layer.mapping


def test_a_mapping_node_that_falls_silent_fails_it(rig: RobotRig) -> None:
    goal = rig.start("lidar_mapping")
    rig.run(5.0)
    rig.layer.reports = False
    terminal = rig.end(goal, within=6.0)
    assert terminal.ending is Ending.ERROR
    assert "has not reported" in terminal.reason


def test_a_mapping_node_that_is_not_there_fails_it(rig: RobotRig) -> None:
    rig.layer.refusal = "the map is full"
    assert "The map is full." in rig.end(rig.start("lidar_mapping")).reason
