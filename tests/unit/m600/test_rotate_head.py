"""The manager of `rotate_head`."""

from __future__ import annotations

import pytest
from drone import Drone

from skillwing.m600.skills.rotate_head import RotateHeadManager


@pytest.fixture
def drone() -> Drone:
    return Drone(RotateHeadManager, height=5.0)


def test_is_aligned_when_the_nose_is_there(drone: Drone) -> None:
    drone.start(heading=1.5).assert_ended("S_ALIGNED")
    assert drone.layer.heading == 1.5
    drone.assert_states(heading_authority="AVAILABLE")


def test_tells_its_error_while_it_turns(drone: Drone) -> None:
    drone.layer.stuck = True
    goal = drone.start(heading=1.5)
    drone.run(2.0)
    assert goal.progress.error == 1.0


def test_interrupted_it_stops_turning(drone: Drone) -> None:
    drone.layer.stuck = True
    goal = drone.start(heading=1.5)
    drone.run(1.0)
    goal.interrupt().assert_ended("IT")
    assert drone.layer.motions == ["Turn", "Stop"]


def test_fails_when_guidance_gives_up(drone: Drone) -> None:
    drone.layer.aborts = True
    goal = drone.start(heading=1.5)
    goal.assert_ended("ERROR", reason="gave up turning")
    assert goal.causes == ["guidance ABORTED", "rotate_head ERROR"]
