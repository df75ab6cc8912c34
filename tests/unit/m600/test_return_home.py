"""The manager of `return_home`."""

from __future__ import annotations

import pytest
from robot_rig import RobotRig

from skillwing.m600.geofence import refusal
from skillwing.services.protocol import Ending
from skillwing.sim_mujoco.topics import FlyTo, Nose


@pytest.fixture
def rig() -> RobotRig:
    rig = RobotRig("return_home", height=3.0)
    rig.layer.position = (6.0, 8.0, 3.0)
    rig.run(0.5)
    return rig


def legs(rig: RobotRig) -> list[tuple[tuple[float, float, float], Nose]]:
    return [(c.motion.target, c.motion.nose) for c in rig.layer.commands if isinstance(c.motion, FlyTo)]


def test_climbs_first_and_then_flies_over_the_home_point(rig: RobotRig) -> None:
    goal = rig.start("return_home", height=5.0, speed=2.0)
    assert rig.end(goal).label == "S_ARRIVED"
    assert legs(rig) == [((6.0, 8.0, 5.0), Nose.FREE), ((0.0, 0.0, 5.0), Nose.ALONG_TRACK)]
    assert rig.layer.position == pytest.approx((0.0, 0.0, 5.0))


def test_never_descends(rig: RobotRig) -> None:
    rig.layer.position = (6.0, 8.0, 9.0)
    rig.run(0.5)
    assert rig.end(rig.start("return_home", height=5.0, speed=2.0)).label == "S_ARRIVED"
    assert rig.layer.position == pytest.approx((0.0, 0.0, 9.0))


def test_tells_the_distance_to_home(rig: RobotRig) -> None:
    goal = rig.start("return_home", height=5.0, speed=2.0)
    rig.run(0.8)
    assert goal.progress is not None
    assert goal.progress["distance"] == pytest.approx(10.0)


def test_an_obstacle_aborts_it(rig: RobotRig) -> None:
    rig.layer.blocked_at = 1.0
    assert rig.end(rig.start("return_home")).label == "S_ABORTED"


def test_guidance_giving_up_aborts_it(rig: RobotRig) -> None:
    rig.layer.aborts = True
    assert rig.end(rig.start("return_home")).label == "S_ABORTED"


def test_a_height_above_the_geofence_is_not_valid(rig: RobotRig) -> None:
    assert rig.end(rig.start("return_home", height=40.0)).ending is Ending.NOT_VALIDATED


@pytest.mark.parametrize("outside", [(42.5, 8.0, 3.0), (6.0, 8.0, 30.5)])
def test_from_just_outside_the_geofence_it_climbs_and_flies_inside(
    rig: RobotRig, outside: tuple[float, float, float]
) -> None:
    rig.layer.position = outside
    rig.run(0.5)
    assert rig.end(rig.start("return_home", height=5.0, speed=5.0)).label == "S_ARRIVED"
    assert [refusal(target) for target, _ in legs(rig)] == [None, None]


def test_interrupted_on_either_leg_it_stops(rig: RobotRig) -> None:
    for wait in (0.5, 3.0):
        goal = rig.start("return_home", height=5.0, speed=1.0)
        rig.run(wait)
        assert rig.interrupt(goal).label == "IT"
    assert rig.motions().count("Stop") == 2
