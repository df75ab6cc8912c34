"""Guidance client: retries, silence, revocation, and the final stop."""

from __future__ import annotations

import pytest
from drone import SKILLSET, Drone
from hypothesis import given, settings
from hypothesis import strategies as st

from skillwing.m600.bridge.node import RobotBridge
from skillwing.m600.skills.goto import GotoManager
from skillwing.onboard.topics.guidance import MotionState

TARGET = {"x": 10.0, "y": 0.0, "z": 5.0}


@pytest.fixture
def drone() -> Drone:
    return Drone(GotoManager, height=5.0)


def test_commands_carry_the_goal_and_its_token(drone: Drone) -> None:
    first = drone.start(target=TARGET)
    first.interrupt().assert_ended("IT")
    second = drone.start(target=TARGET)
    second.assert_ended("S_ARRIVED")
    sent = [(command.goal_id, command.token) for command in drone.layer.commands]
    assert [goal_id for goal_id, _ in sent] == [first.id, first.id, second.id, second.id]
    assert sent[0][1] == sent[1][1] < sent[2][1] == sent[3][1]


def test_a_command_that_nobody_answers_is_sent_again(drone: Drone) -> None:
    drone.layer.deaf = 1
    drone.start(target=TARGET, speed=5.0).assert_ended("S_ARRIVED")


def test_guidance_that_never_answers_fails_the_goal(drone: Drone) -> None:
    drone.layer.deaf = 10_000
    drone.start(target=TARGET).assert_ended("ERROR", reason="Guidance does not answer")
    drone.assert_states(axes_authority="AVAILABLE")


def test_guidance_that_falls_silent_fails_the_goal(drone: Drone) -> None:
    goal = drone.start(target=TARGET, speed=0.5)
    drone.run(2.0)
    drone.layer.reports = False
    goal.assert_ended("ERROR", within=3.5, reason="has not reported for 2 s")


def test_guidance_that_forgot_the_goal_fails_it(drone: Drone) -> None:
    goal = drone.start(target=TARGET, speed=0.5)
    drone.run(2.0)
    drone.layer.body.goal_id, drone.layer.body.state = None, MotionState.IDLE
    goal.assert_ended("ERROR", within=3.5, reason="no longer flies for this goal")


def test_interrupted_before_guidance_took_the_command_it_is_not_flown(drone: Drone) -> None:
    drone.layer.deaf = 1
    drone.start(target=TARGET).interrupt().assert_ended("IT", forced=False)
    drone.run(5.0)
    assert drone.layer.position == (0.0, 0.0, 5.0)


def test_a_drone_that_does_not_come_to_rest_keeps_the_axes_until_the_timeout(drone: Drone) -> None:
    goal = drone.start(target=TARGET, speed=0.5)
    drone.run(1.0)
    goal.interrupt()
    drone.run(0.2)
    drone.layer.body.stopped_at = float("inf")
    drone.run(4.0)
    assert not goal.done
    drone.assert_states(axes_authority="USED")
    goal.assert_ended("IT", forced=True)


def test_a_distance_that_nobody_measures_is_not_published(drone: Drone) -> None:
    goal = drone.start(target=TARGET, speed=0.5)
    drone.run(2.0)
    drone.layer.body.goal_id, drone.layer.body.state = None, MotionState.IDLE
    drone.run(1.5)
    assert not goal.done
    assert goal.progress.distance > 8.0


@settings(max_examples=15, deadline=None)
@given(wait=st.floats(0.0, 6.0), lost=st.integers(0, 2))
def test_whenever_it_is_interrupted_it_ends_at_rest_and_gives_the_axes_back(wait: float, lost: int) -> None:
    drone = Drone(GotoManager, height=5.0)
    goal = drone.send(target=TARGET, speed=2.0)
    drone.run(wait)
    drone.layer.deaf = lost
    terminal = goal.interrupt().wait()
    assert terminal.label in ("IT", "S_ARRIVED")
    assert not terminal.forced
    drone.assert_states(axes_authority="AVAILABLE")
    resting_place = drone.layer.position
    drone.run(5.0)
    assert drone.layer.position == resting_place


def test_after_a_success_the_axis_is_given_back(drone: Drone) -> None:
    drone.start(target=TARGET, speed=5.0).assert_ended("S_ARRIVED")
    assert drone.layer.motions == ["FlyTo", "Stop"]


def test_when_the_manager_dies_the_bridge_revokes_its_token(drone: Drone) -> None:
    goal = drone.start(target=TARGET, speed=0.5)
    drone.kill()
    drone.run(3.0)
    token = drone.layer.commands[0].token
    assert [(revoked.goal_id, revoked.token) for revoked in drone.layer.revoked] == [(goal.id, token)]
    drone.assert_states(axes_authority="AVAILABLE")


def test_a_bridge_that_was_away_revokes_what_was_lost_meanwhile(drone: Drone) -> None:
    goal = drone.start(target=TARGET, speed=0.5)
    drone.kill("bridge")
    drone.kill()
    drone.run(3.0)
    assert drone.layer.revoked == []
    drone.network.attach(RobotBridge(SKILLSET))
    drone.run(0.1)
    assert [revoked.goal_id for revoked in drone.layer.revoked] == [goal.id]
