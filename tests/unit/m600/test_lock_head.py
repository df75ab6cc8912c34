"""The manager of `lock_head`."""

from __future__ import annotations

import pytest
from drone import Drone

from skillwing.m600.skills.goto import GotoManager
from skillwing.m600.skills.lock_head import LockHeadManager


@pytest.fixture
def drone() -> Drone:
    return Drone(LockHeadManager, others=[GotoManager], height=5.0)


def test_holds_the_heading_until_it_is_interrupted(drone: Drone) -> None:
    goal = drone.start(heading=1.5)
    drone.run(30.0)
    goal.assert_running()
    assert drone.layer.heading == 1.5
    goal.interrupt().assert_ended("IT", forced=False)
    drone.assert_states(heading_authority="AVAILABLE")


def test_another_skill_moves_the_body_meanwhile(drone: Drone) -> None:
    lock = drone.start(heading=1.5)
    drone.start_skill("goto", target={"x": 5.0, "y": 0.0, "z": 5.0}).assert_ended("S_ARRIVED")
    lock.assert_running()


def test_fails_when_guidance_gives_up(drone: Drone) -> None:
    drone.layer.aborts = True
    drone.start(heading=1.5).assert_ended("ERROR")
