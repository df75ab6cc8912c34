"""The managers of `goto` and `goto_straight`, which share all but the nose."""

from __future__ import annotations

import pytest
from robot_rig import RobotRig

from skillwing.services.protocol import Ending
from skillwing.sim_mujoco.topics import FlyTo, Nose

TARGET = {"x": 10.0, "y": 0.0, "z": 5.0}


@pytest.fixture(params=["goto", "goto_straight"])
def skill(request: pytest.FixtureRequest) -> str:
    return request.param


@pytest.fixture
def rig(skill: str) -> RobotRig:
    return RobotRig(skill, height=5.0)


def test_arrives_and_says_where(rig: RobotRig, skill: str) -> None:
    goal = rig.start(skill, target=TARGET, speed=2.0)
    rig.run(2.0)
    assert goal.progress is not None
    assert 5.0 < goal.progress["distance"] < 9.0
    terminal = rig.end(goal)
    assert terminal.label == "S_ARRIVED"
    assert terminal.output is not None
    assert terminal.output["stopped_at"] == pytest.approx(TARGET, abs=0.2)


def test_only_goto_leaves_the_nose_alone(rig: RobotRig, skill: str) -> None:
    rig.end(rig.start(skill, target=TARGET, speed=5.0))
    motion = rig.layer.commands[0].motion
    assert isinstance(motion, FlyTo)
    assert motion.nose is (Nose.FREE if skill == "goto" else Nose.ALONG_TRACK)


def test_blocked_it_says_where_it_stands_and_how_far_the_obstacle_is(rig: RobotRig, skill: str) -> None:
    rig.layer.blocked_at, rig.layer.free_distance = 4.0, 2.2
    terminal = rig.end(rig.start(skill, target=TARGET))
    assert (terminal.label, terminal.success) == ("S_BLOCKED", False)
    assert terminal.output is not None
    assert terminal.output["stopped_at"]["x"] == pytest.approx(6.0, abs=0.2)
    assert terminal.output["obstacle_distance"] == pytest.approx(2.2)


def test_blocked_by_something_unseen_it_invents_no_distance(rig: RobotRig, skill: str) -> None:
    rig.layer.blocked_at = 4.0
    output = rig.end(rig.start(skill, target=TARGET)).output
    assert output is not None
    assert output["obstacle_distance"] == 1000.0


def test_is_aborted_when_guidance_gives_up(rig: RobotRig, skill: str) -> None:
    rig.layer.aborts = True
    assert rig.end(rig.start(skill, target=TARGET)).label == "S_ABORTED"


def test_a_target_outside_the_geofence_is_not_valid(rig: RobotRig, skill: str) -> None:
    terminal = rig.end(rig.start(skill, target={"x": 300.0, "y": 0.0, "z": 4.0}))
    assert terminal.ending is Ending.NOT_VALIDATED
    assert "The target (300, 0, 4) lies outside the geofence. Stay between (-12, -12, 1)" in terminal.reason
    assert rig.layer.commands == []


def test_what_guidance_refuses_ends_with_its_sentence(rig: RobotRig, skill: str) -> None:
    rig.layer.refusal = "the target lies outside the geofence"
    terminal = rig.end(rig.start(skill, target=TARGET))
    assert terminal.ending is Ending.ERROR
    assert "The target lies outside the geofence. Stay inside." in terminal.reason


def test_a_critical_battery_ends_it_and_stops_the_drone(rig: RobotRig, skill: str) -> None:
    goal = rig.start(skill, target=TARGET, speed=0.5)
    rig.layer.percent = 10.0
    terminal = rig.end(goal, within=5.0)
    assert (terminal.ending, terminal.invariant) == (Ending.INVARIANT_VIOLATED, "charged")
    assert rig.motions()[-1] == "Stop"
