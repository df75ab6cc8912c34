"""The manager of `lidar_mapping`."""

from __future__ import annotations

import pytest
from drone import Drone

from skillwing.m600.skills.lidar_mapping import LidarMappingManager
from skillwing.onboard.topics.sensors import SensorStatus


@pytest.fixture
def drone() -> Drone:
    return Drone(LidarMappingManager, height=5.0)


def test_runs_until_it_is_interrupted(drone: Drone) -> None:
    goal = drone.start()
    drone.run(20.0)
    goal.assert_running()
    assert drone.layer.mapping
    assert goal.progress.voxels == 10
    drone.assert_states(slam_status="RUNNING")
    goal.interrupt().assert_ended("IT")
    assert not drone.layer.mapping
    drone.assert_states(slam_status="IDLE")


def test_a_diverged_map_ends_it(drone: Drone) -> None:
    goal = drone.start()
    drone.run(5.0)
    drone.layer.diverged = True
    goal.assert_ended("S_DIVERGED", within=2.0, reason="DIVERGED: nothing fits any more.")
    assert not drone.layer.mapping
    assert goal.causes == ["map DIVERGED", "lidar_mapping S_DIVERGED"]
    assert [record.text for record in drone.history.records if record.subject == "map"] == ["nothing fits any more"]


def test_a_failing_lidar_ends_it_and_stops_the_mapping(drone: Drone) -> None:
    goal = drone.start()
    drone.layer.report_health("lidar", SensorStatus.FAILED, "health-1")
    goal.assert_ended("RI", within=0.1, invariant="lidar_ok")
    assert not drone.layer.mapping


def test_a_mapping_node_that_falls_silent_fails_it(drone: Drone) -> None:
    goal = drone.start()
    drone.run(5.0)
    drone.layer.reports = False
    goal.assert_ended("ERROR", within=6.0, reason="has not reported")


def test_a_mapping_node_that_was_started_again_fails_it(drone: Drone) -> None:
    """The new process knows nothing of the goal, and maps nothing. The old map is lost."""
    goal = drone.start()
    drone.run(5.0)
    drone.layer.mapping = False
    goal.assert_ended("ERROR", within=2.0, reason="has lost the map")
    drone.assert_states(slam_status="IDLE")
    again = drone.start()
    drone.run(5.0)
    again.assert_running()


def test_a_mapping_node_that_refuses_fails_it(drone: Drone) -> None:
    drone.layer.refusal = "the map is full"
    drone.start().assert_ended("ERROR", reason="The map is full.")
