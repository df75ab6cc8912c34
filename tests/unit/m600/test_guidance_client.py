"""What every skill that flies owes to the guidance client: retries, silence, revocation, stopping for good."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from robot_rig import RobotRig

from skillwing.services.protocol import Ending
from skillwing.sim_mujoco.topics import MotionState

TARGET = {"x": 10.0, "y": 0.0, "z": 5.0}


@pytest.fixture
def rig() -> RobotRig:
    return RobotRig("goto", height=5.0)


def test_commands_carry_the_goal_and_its_token(rig: RobotRig) -> None:
    first, second = (rig.start("goto", target=TARGET), None)
    rig.interrupt(first)
    second = rig.start("goto", target=TARGET)
    rig.end(second)
    sent = [(command.goal_id, command.token) for command in rig.layer.commands]
    assert [goal_id for goal_id, _ in sent] == [first.goal_id, first.goal_id, second.goal_id]
    assert sent[0][1] == sent[1][1] < sent[2][1]


def test_a_command_that_nobody_answers_is_sent_again(rig: RobotRig) -> None:
    rig.layer.deaf = 1
    goal = rig.start("goto", target=TARGET, speed=5.0)
    assert rig.end(goal).label == "S_ARRIVED"


def test_guidance_that_never_answers_fails_the_goal(rig: RobotRig) -> None:
    rig.layer.deaf = 10_000
    terminal = rig.end(rig.start("goto", target=TARGET))
    assert terminal.ending is Ending.ERROR
    assert "Guidance does not answer" in terminal.reason
    assert rig.interface.state("axes_authority") == "AVAILABLE"


def test_guidance_that_falls_silent_fails_the_goal(rig: RobotRig) -> None:
    goal = rig.start("goto", target=TARGET, speed=0.5)
    rig.run(2.0)
    rig.layer.reports = False
    terminal = rig.end(goal, within=3.5)
    assert terminal.ending is Ending.ERROR
    assert "has not reported for 2 s" in terminal.reason


def test_guidance_that_forgot_the_goal_fails_it(rig: RobotRig) -> None:
    goal = rig.start("goto", target=TARGET, speed=0.5)
    rig.run(2.0)
    rig.layer.body.goal_id, rig.layer.body.state = None, MotionState.IDLE
    assert "no longer flies for this goal" in rig.end(goal, within=3.5).reason


def test_interrupted_before_guidance_took_the_command_it_is_not_flown(rig: RobotRig) -> None:
    rig.layer.deaf = 1
    goal = rig.start("goto", target=TARGET)
    terminal = rig.interrupt(goal)
    assert (terminal.ending, terminal.forced) == (Ending.INTERRUPTED, False)
    rig.run(5.0)
    assert rig.layer.position == (0.0, 0.0, 5.0)


def test_a_drone_that_does_not_come_to_rest_keeps_the_axes_until_the_timeout(rig: RobotRig) -> None:
    goal = rig.start("goto", target=TARGET, speed=0.5)
    rig.run(1.0)
    rig.interface.interrupt(goal)
    rig.run(0.2)
    rig.layer.body.stopped_at = float("inf")
    rig.run(4.0)
    assert not goal.done
    assert rig.interface.state("axes_authority") == "USED"
    assert rig.end(goal).forced


@settings(max_examples=15, deadline=None)
@given(wait=st.floats(0.0, 6.0), lost=st.integers(0, 2))
def test_whenever_it_is_interrupted_it_ends_at_rest_and_gives_the_axes_back(wait: float, lost: int) -> None:
    rig = RobotRig("goto", height=5.0)
    goal = rig.interface.start("goto", {"target": TARGET, "speed": 2.0})
    rig.run(wait)
    rig.layer.deaf = lost
    terminal = rig.interrupt(goal)
    assert terminal.label in ("IT", "S_ARRIVED")
    assert not terminal.forced
    assert rig.interface.state("axes_authority") == "AVAILABLE"
    resting_place = rig.layer.position
    rig.run(5.0)
    assert rig.layer.position == resting_place


def test_after_a_success_nothing_is_stopped(rig: RobotRig) -> None:
    rig.end(rig.start("goto", target=TARGET, speed=5.0))
    assert rig.motions() == ["FlyTo"]


def test_when_the_manager_dies_the_bridge_revokes_its_token(rig: RobotRig) -> None:
    goal = rig.start("goto", target=TARGET, speed=0.5)
    rig.manager_buses["goto"].close()
    rig.run(3.0)
    token = rig.layer.commands[0].token
    assert [(revoked.goal_id, revoked.token) for revoked in rig.layer.revoked] == [(goal.goal_id, token)]
    assert rig.interface.state("axes_authority") == "AVAILABLE"
