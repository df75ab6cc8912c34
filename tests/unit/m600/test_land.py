"""The manager of `land`."""

from __future__ import annotations

import pytest
from drone import Drone

from skillwing.m600.skills.land import LandManager


@pytest.fixture
def drone() -> Drone:
    return Drone(LandManager, height=5.0)


def test_has_landed_when_the_rotors_are_off(drone: Drone) -> None:
    drone.layer.rotors_run_on = True
    goal = drone.start(speed=1.0)
    drone.run(6.0)
    assert drone.layer.on_ground
    goal.assert_running()
    drone.layer.rotors_run_on = False
    goal.assert_ended("S_LANDED", within=1.0)
    drone.assert_states(flight_status="ON_GROUND")


def test_is_blocked_when_it_does_not_come_down(drone: Drone) -> None:
    goal = drone.start(speed=1.0)
    drone.run(2.0)
    drone.layer.stuck = True
    goal.assert_ended("S_BLOCKED", within=6.0)
    assert drone.layer.motions[-1] == "Stop"


def test_fails_with_guidances_words_when_guidance_gives_up(drone: Drone) -> None:
    drone.layer.aborts = True
    drone.start().assert_ended("ERROR", reason="gave up")


def test_a_second_landing_has_its_own_patience(drone: Drone) -> None:
    goal = drone.start(speed=0.5)
    drone.run(2.0)
    goal.interrupt().assert_ended("IT")
    drone.run(10.0)
    drone.start(speed=0.5).assert_ended("S_LANDED")


def test_on_the_ground_it_is_not_ready() -> None:
    Drone(LandManager).start().assert_ended("NR", failing=["flying"])
