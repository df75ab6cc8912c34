"""The manager of `takeoff`."""

from __future__ import annotations

import pytest
from robot_rig import RobotRig

from skillwing.services.protocol import Ending


@pytest.fixture
def rig() -> RobotRig:
    return RobotRig("takeoff")


def test_climbs_to_the_height(rig: RobotRig) -> None:
    goal = rig.start("takeoff", height=5.0, speed=1.0)
    assert rig.end(goal).label == "S_AT_ALTITUDE"
    assert rig.layer.position[2] == pytest.approx(5.0)
    assert rig.interface.state("axes_authority") == "AVAILABLE"
    assert rig.motions() == ["TakeOff"]


def test_tells_its_height_while_it_climbs(rig: RobotRig) -> None:
    goal = rig.start("takeoff", height=5.0, speed=1.0)
    rig.run(3.0)
    assert goal.progress is not None
    assert goal.progress["height"] == pytest.approx(3.0, abs=0.6)


def test_is_blocked_when_it_does_not_climb_for_five_seconds(rig: RobotRig) -> None:
    rig.layer.stuck = True
    goal = rig.start("takeoff")
    rig.run(4.5)
    assert not goal.done
    assert rig.end(goal, within=1.5).label == "S_BLOCKED"
    assert rig.motions()[-1] == "Stop"


def test_is_blocked_when_it_hangs_half_way(rig: RobotRig) -> None:
    goal = rig.start("takeoff", height=5.0, speed=1.0)
    rig.run(2.0)
    rig.layer.stuck = True
    assert rig.end(goal, within=6.0).label == "S_BLOCKED"


def test_is_aborted_when_it_drifts_two_metres(rig: RobotRig) -> None:
    rig.layer.drift = 1.0
    goal = rig.start("takeoff", height=10.0, speed=1.0)
    terminal = rig.end(goal)
    assert terminal.label == "S_ABORTED"
    assert not terminal.success
    assert rig.motions()[-1] == "Stop"


def test_is_aborted_when_guidance_gives_up(rig: RobotRig) -> None:
    rig.layer.aborts = True
    assert rig.end(rig.start("takeoff")).label == "S_ABORTED"


def test_a_height_above_the_geofence_is_not_valid(rig: RobotRig) -> None:
    terminal = rig.end(rig.start("takeoff", height=31.0))
    assert terminal.ending is Ending.NOT_VALIDATED
    assert "(42, 32, 30)" in terminal.reason
    assert rig.layer.commands == []


def test_interrupted_it_ends_when_the_drone_is_at_rest(rig: RobotRig) -> None:
    goal = rig.start("takeoff", height=10.0, speed=1.0)
    rig.run(2.0)
    rig.interface.interrupt(goal)
    rig.run(0.3)
    assert not goal.done, "the drone still brakes"
    terminal = rig.end(goal)
    assert (terminal.ending, terminal.forced) == (Ending.INTERRUPTED, False)
    assert rig.interface.state("axes_authority") == "AVAILABLE"


def test_when_the_pilot_takes_over_the_drone_is_told_to_stop(rig: RobotRig) -> None:
    goal = rig.start("takeoff", height=10.0, speed=1.0)
    rig.run(2.0)
    rig.layer.authority = False
    terminal = rig.end(goal)
    assert (terminal.ending, terminal.invariant) == (Ending.INVARIANT_VIOLATED, "authority")
    assert rig.motions()[-1] == "Stop"
    assert [revoked.goal_id for revoked in rig.layer.revoked] == [goal.goal_id]
