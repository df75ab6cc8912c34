"""The manager of `lock_head`."""

from __future__ import annotations

import pytest
from robot_rig import RobotRig

from skillwing.services.protocol import Ending


@pytest.fixture
def rig() -> RobotRig:
    return RobotRig("lock_head", "goto", height=5.0)


def test_holds_the_heading_until_it_is_interrupted(rig: RobotRig) -> None:
    goal = rig.start("lock_head", heading=1.5)
    rig.run(30.0)
    assert not goal.done
    assert rig.layer.heading == 1.5
    terminal = rig.interrupt(goal)
    assert (terminal.label, terminal.forced) == ("IT", False)
    assert rig.interface.state("heading_authority") == "AVAILABLE"


def test_another_skill_moves_the_body_meanwhile(rig: RobotRig) -> None:
    lock = rig.start("lock_head", heading=1.5)
    assert rig.end(rig.start("goto", target={"x": 5.0, "y": 0.0, "z": 5.0})).label == "S_ARRIVED"
    assert not lock.done


def test_fails_when_guidance_gives_up(rig: RobotRig) -> None:
    rig.layer.aborts = True
    assert rig.end(rig.start("lock_head", heading=1.5)).ending is Ending.ERROR
