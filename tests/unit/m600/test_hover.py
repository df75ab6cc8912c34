"""The manager of `hover`."""

from __future__ import annotations

import pytest
from drone import Drone

from skillwing.m600.skills.hover import HoverManager


@pytest.fixture
def drone() -> Drone:
    return Drone(HoverManager, height=5.0)


def test_is_done_after_its_duration(drone: Drone) -> None:
    goal = drone.start(duration=4.0)
    drone.run(3.8)
    goal.assert_running()
    assert goal.progress.remaining < 1.0
    goal.assert_ended("S_DONE", within=0.5)


def test_interrupted_it_never_gets_done(drone: Drone) -> None:
    goal = drone.start(duration=4.0)
    drone.run(3.9)
    goal.interrupt().assert_ended("IT")
    drone.run(5.0)
    drone.assert_states(axes_authority="AVAILABLE")


def test_fails_when_guidance_no_longer_holds(drone: Drone) -> None:
    drone.layer.aborts = True
    drone.start(duration=10.0).assert_ended("ERROR", within=5.0, reason="no longer holds")
