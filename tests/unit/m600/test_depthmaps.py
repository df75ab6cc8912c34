"""The managers of `zed_depthmap` and `lidar_depthmap`, which share all but the sensor."""

from __future__ import annotations

import pytest
from robot_rig import RobotRig

from skillwing.services.protocol import Ending
from skillwing.sim_mujoco.topics import ObstacleSource, SensorStatus


@pytest.fixture(params=["zed", "lidar"])
def sensor(request: pytest.FixtureRequest) -> str:
    return request.param


@pytest.fixture
def rig(sensor: str) -> RobotRig:
    return RobotRig(f"{sensor}_depthmap", height=5.0)


def test_runs_until_it_is_interrupted(rig: RobotRig, sensor: str) -> None:
    goal = rig.start(f"{sensor}_depthmap")
    rig.run(20.0)
    assert not goal.done
    assert rig.layer.source == ObstacleSource(sensor.upper())
    assert rig.interface.state("depthmap_source") == sensor.upper()
    assert goal.progress == {"obstacle_distance": 7.0}
    terminal = rig.interrupt(goal)
    assert (terminal.label, terminal.forced) == ("IT", False)
    assert rig.layer.source is ObstacleSource.NONE
    assert rig.interface.state("depthmap_source") == "NONE"


def test_the_free_way_counts_before_what_is_ahead(rig: RobotRig, sensor: str) -> None:
    rig.layer.free_distance = 12.0
    goal = rig.start(f"{sensor}_depthmap")
    rig.run(2.0)
    assert goal.progress == {"obstacle_distance": 12.0}


def test_without_data_from_the_start_it_ends_after_two_seconds(rig: RobotRig, sensor: str) -> None:
    rig.layer.measures = False
    goal = rig.start(f"{sensor}_depthmap")
    rig.run(1.5)
    assert not goal.done
    assert rig.end(goal, within=1.5).label == "S_NO_DATA"
    assert rig.layer.source is ObstacleSource.NONE


def test_when_data_cease_it_ends_after_two_seconds(rig: RobotRig, sensor: str) -> None:
    goal = rig.start(f"{sensor}_depthmap")
    rig.run(5.0)
    rig.layer.measures = False
    rig.run(1.4)
    assert not goal.done
    assert rig.end(goal, within=2.0).label == "S_NO_DATA"


def test_a_failing_sensor_ends_it_at_once(rig: RobotRig, sensor: str) -> None:
    goal = rig.start(f"{sensor}_depthmap")
    rig.layer.report_health(sensor, SensorStatus.FAILED, "health-1")
    terminal = rig.end(goal, within=0.1)
    assert (terminal.ending, terminal.invariant) == (Ending.INVARIANT_VIOLATED, f"{sensor}_ok")
    assert rig.layer.source is ObstacleSource.NONE


def test_an_obstacle_node_that_does_not_answer_gives_no_data(rig: RobotRig, sensor: str) -> None:
    rig.layer.deaf = 1000
    terminal = rig.end(rig.start(f"{sensor}_depthmap"))
    assert terminal.label == "S_NO_DATA"
    assert rig.interface.state("depthmap_source") == "NONE"


def test_an_obstacle_node_that_refuses_fails_it(rig: RobotRig, sensor: str) -> None:
    rig.layer.refusal = "no such source"
    terminal = rig.end(rig.start(f"{sensor}_depthmap"))
    assert terminal.ending is Ending.ERROR
    assert "The obstacle node refused. No such source." in terminal.reason
