"""The manager of `rotate_head`."""

from __future__ import annotations

import pytest
from robot_rig import RobotRig

from skillwing.services.protocol import Ending


@pytest.fixture
def rig() -> RobotRig:
    return RobotRig("rotate_head", height=5.0)


def test_is_aligned_when_the_nose_is_there(rig: RobotRig) -> None:
    goal = rig.start("rotate_head", heading=1.5)
    assert rig.end(goal).label == "S_ALIGNED"
    assert rig.layer.heading == 1.5
    assert rig.interface.state("heading_authority") == "AVAILABLE"


def test_tells_its_error_while_it_turns(rig: RobotRig) -> None:
    rig.layer.stuck = True
    goal = rig.start("rotate_head", heading=1.5)
    rig.run(2.0)
    assert goal.progress == {"error": 1.0}


def test_interrupted_it_stops_turning(rig: RobotRig) -> None:
    rig.layer.stuck = True
    goal = rig.start("rotate_head", heading=1.5)
    rig.run(1.0)
    assert rig.interrupt(goal).label == "IT"
    assert rig.motions() == ["Turn", "Stop"]


def test_fails_when_guidance_gives_up(rig: RobotRig) -> None:
    rig.layer.aborts = True
    assert rig.end(rig.start("rotate_head", heading=1.5)).ending is Ending.ERROR
