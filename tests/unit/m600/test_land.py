"""The manager of `land`."""

from __future__ import annotations

import pytest
from robot_rig import RobotRig

from skillwing.services.protocol import Ending


@pytest.fixture
def rig() -> RobotRig:
    return RobotRig("land", height=5.0)


def test_has_landed_when_the_rotors_are_off(rig: RobotRig) -> None:
    rig.layer.rotors_run_on = True
    goal = rig.start("land", speed=1.0)
    rig.run(6.0)
    assert rig.layer.on_ground
    assert not goal.done
    rig.layer.rotors_run_on = False
    assert rig.end(goal, within=1.0).label == "S_LANDED"
    assert rig.interface.state("flight_status") == "ON_GROUND"


def test_is_blocked_when_it_does_not_come_down(rig: RobotRig) -> None:
    goal = rig.start("land", speed=1.0)
    rig.run(2.0)
    rig.layer.stuck = True
    assert rig.end(goal, within=6.0).label == "S_BLOCKED"
    assert rig.motions()[-1] == "Stop"


def test_fails_with_guidances_words_when_guidance_gives_up(rig: RobotRig) -> None:
    rig.layer.aborts = True
    terminal = rig.end(rig.start("land"))
    assert terminal.ending is Ending.ERROR
    assert "gave up" in terminal.reason


def test_a_second_landing_has_its_own_patience(rig: RobotRig) -> None:
    goal = rig.start("land", speed=0.5)
    rig.run(2.0)
    rig.interrupt(goal)
    rig.run(10.0)
    assert rig.end(rig.start("land", speed=0.5)).label == "S_LANDED"


def test_on_the_ground_it_is_not_ready() -> None:
    rig = RobotRig("land")
    terminal = rig.end(rig.start("land"))
    assert (terminal.ending, terminal.failing) == (Ending.NOT_READY, ("flying",))
