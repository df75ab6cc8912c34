"""The manager of `inspect`."""

from __future__ import annotations

import pytest
from drone import Drone

from skillwing.m600.skills.inspect import InspectManager
from skillwing.onboard.topics.guidance import Orbit

CENTER = {"x": 15.0, "y": 10.0, "z": 0.0}


@pytest.fixture
def drone() -> Drone:
    return Drone(InspectManager, height=5.0)


def test_flies_the_orbit_and_is_completed(drone: Drone) -> None:
    goal = drone.start(center=CENTER, radius=5.0, height=6.0, laps=0.5, speed=2.0)
    drone.run(4.0)
    assert 0.2 < goal.progress.laps_done < 0.3
    goal.assert_ended("S_COMPLETED", within=10.0)
    motion = drone.layer.commands[0].motion
    assert motion == Orbit(center=(15.0, 10.0, 0.0), radius=5.0, height=6.0, laps=0.5, speed=2.0)


def test_an_obstacle_blocks_it(drone: Drone) -> None:
    drone.layer.blocked_at, drone.layer.body.text = 4.0, "an obstacle stands on the way"
    goal = drone.start(center=CENTER, radius=5.0, height=6.0)
    goal.assert_ended("S_BLOCKED", success=False, reason="an obstacle stands on the way")


def test_is_aborted_when_guidance_gives_up(drone: Drone) -> None:
    drone.layer.aborts, drone.layer.body.text = True, "the drone has left the geofence"
    goal = drone.start(center=CENTER, radius=5.0, height=6.0)
    goal.assert_ended("S_ABORTED", success=False, reason="the drone has left the geofence")


@pytest.mark.parametrize(("radius", "height"), [(24.0, 6.0), (5.0, 40.0)])
def test_a_circle_that_leaves_the_geofence_is_not_valid(drone: Drone, radius: float, height: float) -> None:
    goal = drone.start(center=CENTER, radius=radius, height=height)
    goal.assert_ended("NV", reason="lies outside the geofence")
    assert drone.layer.commands == []


def test_interrupted_it_stops(drone: Drone) -> None:
    goal = drone.start(center=CENTER, radius=5.0, height=6.0, speed=0.5)
    drone.run(2.0)
    goal.interrupt().assert_ended("IT")
    assert drone.layer.motions == ["Orbit", "Stop"]


def test_a_critical_battery_ends_it_and_stops_the_drone(drone: Drone) -> None:
    goal = drone.start(center=CENTER, radius=5.0, height=6.0, speed=0.5)
    drone.layer.percent = 10.0
    goal.assert_ended("RI", within=5.0, invariant="charged")
    assert drone.layer.motions[-1] == "Stop"
