"""The manager of `takeoff`."""

from __future__ import annotations

import pytest
from drone import Drone

from skillwing.m600.skills.takeoff import TakeoffManager


@pytest.fixture
def drone() -> Drone:
    return Drone(TakeoffManager)


def test_climbs_to_the_height(drone: Drone) -> None:
    drone.start(height=5.0, speed=1.0).assert_ended("S_AT_ALTITUDE")
    assert drone.layer.position[2] == pytest.approx(5.0)
    assert drone.layer.motions == ["TakeOff", "Stop"]
    drone.assert_states(axes_authority="AVAILABLE")


def test_tells_its_height_while_it_climbs(drone: Drone) -> None:
    goal = drone.start(height=5.0, speed=1.0)
    drone.run(3.0)
    assert goal.progress.height == pytest.approx(3.0, abs=0.6)


def test_is_blocked_when_it_does_not_climb_for_five_seconds(drone: Drone) -> None:
    drone.layer.stuck = True
    goal = drone.start()
    drone.run(4.5)
    goal.assert_running()
    goal.assert_ended("S_BLOCKED", within=1.5, reason="the drone no longer climbs, at 0.0 m")
    assert drone.layer.motions[-1] == "Stop"


def test_is_blocked_when_it_hangs_half_way(drone: Drone) -> None:
    goal = drone.start(height=5.0, speed=1.0)
    drone.run(2.0)
    drone.layer.stuck = True
    goal.assert_ended("S_BLOCKED", within=6.0)


def test_is_aborted_when_it_drifts_two_metres(drone: Drone) -> None:
    drone.layer.drift = 1.0
    drone.start(height=10.0, speed=1.0).assert_ended("S_ABORTED", success=False, reason="has drifted 2.")
    assert drone.layer.motions[-1] == "Stop"


def test_is_aborted_when_guidance_gives_up(drone: Drone) -> None:
    drone.layer.aborts, drone.layer.body.text = True, "the drone has left the geofence"
    drone.start().assert_ended("S_ABORTED", reason="the drone has left the geofence")


def test_a_height_above_the_geofence_is_not_valid(drone: Drone) -> None:
    drone.start(height=31.0).assert_ended("NV", reason="(42, 32, 30)")
    assert drone.layer.commands == []


def test_interrupted_it_ends_when_the_drone_is_at_rest(drone: Drone) -> None:
    goal = drone.start(height=10.0, speed=1.0)
    drone.run(2.0)
    goal.interrupt()
    drone.run(0.3)
    assert not goal.done, "the drone still brakes"
    goal.assert_ended("IT", forced=False)
    drone.assert_states(axes_authority="AVAILABLE")


def test_when_the_pilot_takes_over_the_drone_gets_a_stop(drone: Drone) -> None:
    goal = drone.start(height=10.0, speed=1.0)
    drone.run(2.0)
    drone.layer.authority = False
    goal.assert_ended("RI", invariant="authority")
    assert drone.layer.motions[-1] == "Stop"
    assert [revoked.goal_id for revoked in drone.layer.revoked] == [goal.id]


def test_without_navigation_it_does_not_climb_and_says_why(drone: Drone) -> None:
    drone.layer.navigates = False
    goal = drone.start(height=5.0, speed=1.0)
    goal.assert_ended("ERROR", within=3.0)
    assert "no navigation solution" in goal.terminal.reason
    assert drone.layer.motions == []
    drone.assert_states(axes_authority="AVAILABLE")


def test_interrupted_before_it_knows_where_it_is_it_ends_at_once(drone: Drone) -> None:
    drone.layer.navigates = False
    goal = drone.start(height=5.0, speed=1.0)
    goal.interrupt()
    goal.assert_ended("IT", within=0.5)
    drone.layer.navigates = True
    drone.run(1.0)
    assert drone.layer.motions == []


def test_what_an_earlier_goal_heard_is_forgotten(drone: Drone) -> None:
    drone.start(height=2.0, speed=2.0).assert_ended("S_AT_ALTITUDE")
    drone.layer.on_ground = True
    drone.run(2.0)
    drone.layer.navigates = False
    drone.start(height=5.0, speed=1.0).assert_ended("ERROR", within=3.0)
