"""Common cases of `zed_depthmap` and `lidar_depthmap`, which differ in the sensor only."""

from __future__ import annotations

from typing import Any, ClassVar

import pytest
from drone import Drone

from skillwing.onboard.topics.obstacles import ObstacleSource
from skillwing.onboard.topics.sensors import SensorStatus
from skillwing.services.managers.hooks import SkillHooks


class DepthmapCases:
    """Cases for subclasses, which set the manager's class and the sensor's name."""

    manager: ClassVar[type[SkillHooks[Any, Any, Any]]]
    sensor: ClassVar[str]

    @pytest.fixture
    def drone(self) -> Drone:
        return Drone(self.manager, height=5.0)

    def test_runs_until_it_is_interrupted(self, drone: Drone) -> None:
        goal = drone.start()
        drone.run(20.0)
        goal.assert_running()
        assert drone.layer.source == ObstacleSource(self.sensor.upper())
        drone.assert_states(depthmap_source=self.sensor.upper())
        assert goal.progress.obstacle_distance == 7.0
        goal.interrupt().assert_ended("IT", forced=False)
        assert drone.layer.source is ObstacleSource.NONE
        drone.assert_states(depthmap_source="NONE")

    def test_the_free_way_counts_before_what_is_ahead(self, drone: Drone) -> None:
        drone.layer.free_distance = 12.0
        goal = drone.start()
        drone.run(2.0)
        assert goal.progress.obstacle_distance == 12.0

    def test_without_data_from_the_start_it_ends_after_two_seconds(self, drone: Drone) -> None:
        drone.layer.measures = False
        goal = drone.start()
        drone.run(1.5)
        goal.assert_running()
        goal.assert_ended("S_NO_DATA", within=1.5, reason="no measurement for 2 s")
        assert drone.layer.source is ObstacleSource.NONE

    def test_when_data_cease_it_ends_after_two_seconds(self, drone: Drone) -> None:
        goal = drone.start()
        drone.run(5.0)
        drone.layer.measures = False
        drone.run(1.4)
        goal.assert_running()
        goal.assert_ended("S_NO_DATA", within=2.0)

    def test_a_failing_sensor_ends_it_at_once(self, drone: Drone) -> None:
        goal = drone.start()
        drone.layer.report_health(self.sensor, SensorStatus.FAILED, "health-1")
        goal.assert_ended("RI", within=0.1, invariant=f"{self.sensor}_ok")
        assert drone.layer.source is ObstacleSource.NONE

    def test_an_obstacle_node_that_does_not_answer_gives_no_data(self, drone: Drone) -> None:
        drone.layer.deaf = 1000
        drone.start().assert_ended("S_NO_DATA")
        drone.assert_states(depthmap_source="NONE")

    def test_an_obstacle_node_that_refuses_fails_it(self, drone: Drone) -> None:
        drone.layer.refusal = "no such source"
        drone.start().assert_ended("ERROR", reason="The obstacle node refused. No such source.")
