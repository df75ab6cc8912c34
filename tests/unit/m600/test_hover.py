"""The manager of `hover`."""

from __future__ import annotations

import pytest
from robot_rig import RobotRig

from skillwing.services.protocol import Ending


@pytest.fixture
def rig() -> RobotRig:
    return RobotRig("hover", height=5.0)


def test_is_done_after_its_duration(rig: RobotRig) -> None:
    goal = rig.start("hover", duration=4.0)
    rig.run(3.8)
    assert not goal.done
    assert goal.progress is not None
    assert goal.progress["remaining"] < 1.0
    assert rig.end(goal, within=0.5).label == "S_DONE"


def test_interrupted_it_never_gets_done(rig: RobotRig) -> None:
    goal = rig.start("hover", duration=4.0)
    rig.run(3.9)
    assert rig.interrupt(goal).label == "IT"
    rig.run(5.0)
    assert rig.interface.state("axes_authority") == "AVAILABLE"


def test_fails_when_guidance_no_longer_holds(rig: RobotRig) -> None:
    rig.layer.aborts = True
    assert rig.end(rig.start("hover", duration=10.0), within=5.0).ending is Ending.ERROR
