"""The manager of `return_home`."""

from __future__ import annotations

import pytest
from drone import Drone
from m600_layer import FENCE

from skillwing.m600.skills.return_home import ReturnHomeManager
from skillwing.onboard.frames.extent import Box
from skillwing.onboard.topics.guidance import FlyTo, YawMode


@pytest.fixture
def drone() -> Drone:
    drone = Drone(ReturnHomeManager, height=3.0)
    put(drone, (6.0, 8.0, 3.0))
    return drone


def put(drone: Drone, position: tuple[float, float, float]) -> None:
    drone.layer.position = position
    drone.run(0.5)


def legs(drone: Drone) -> list[tuple[tuple[float, float, float], YawMode]]:
    return [(c.motion.target, c.motion.nose) for c in drone.layer.commands if isinstance(c.motion, FlyTo)]


def test_climbs_first_and_then_flies_over_the_home_point(drone: Drone) -> None:
    drone.start(height=5.0, speed=2.0).assert_ended("S_ARRIVED")
    assert legs(drone) == [((6.0, 8.0, 5.0), YawMode.FREE), ((0.0, 0.0, 5.0), YawMode.IN_VIEW)]
    assert drone.layer.position == pytest.approx((0.0, 0.0, 5.0))


def test_never_descends(drone: Drone) -> None:
    put(drone, (6.0, 8.0, 9.0))
    drone.start(height=5.0, speed=2.0).assert_ended("S_ARRIVED")
    assert drone.layer.position == pytest.approx((0.0, 0.0, 9.0))


def test_tells_the_distance_to_home(drone: Drone) -> None:
    goal = drone.start(height=5.0, speed=2.0)
    drone.run(0.8)
    assert goal.progress.distance == pytest.approx(10.0)


def block_ways_home(drone: Drone, times: float, seconds: float = 20.0) -> None:
    """Let time pass while something stands in the first so many ways home, and nothing above the drone."""
    for _ in range(round(seconds / 0.01)):
        home = [nose for _, nose in legs(drone) if nose is YawMode.IN_VIEW]
        on_way_home = bool(legs(drone)) and legs(drone)[-1][1] is YawMode.IN_VIEW
        drone.layer.blocked_at = 6.5 if on_way_home and len(home) <= times else None
        drone.run(0.01)


def test_it_climbs_over_what_stands_in_its_way(drone: Drone) -> None:
    goal = drone.start(height=5.0, speed=5.0)
    block_ways_home(drone, times=1)
    goal.assert_ended("S_ARRIVED")
    assert [target[2] for target, nose in legs(drone) if nose is YawMode.FREE] == [5.0, 8.0]
    assert drone.layer.position == pytest.approx((0.0, 0.0, 8.0))


def test_an_obstacle_as_high_as_the_ceiling_aborts_it(drone: Drone) -> None:
    put(drone, (6.0, 8.0, 24.0))
    goal = drone.start(height=5.0, speed=5.0)
    block_ways_home(drone, times=99)
    goal.assert_ended("S_ABORTED")
    assert [target[2] for target, nose in legs(drone) if nose is YawMode.IN_VIEW] == [24.0, 27.0, 30.0]


def test_an_obstacle_above_aborts_it(drone: Drone) -> None:
    drone.layer.blocked_at, drone.layer.body.text = 1.0, "an obstacle stands on the way"
    drone.start(height=5.0).assert_ended("S_ABORTED", reason="an obstacle stands on the way")
    assert len(legs(drone)) == 1


def test_guidance_giving_up_aborts_it(drone: Drone) -> None:
    drone.layer.aborts, drone.layer.body.text = True, "the drone has left the geofence"
    drone.start().assert_ended("S_ABORTED", reason="the drone has left the geofence")


def test_a_height_above_the_geofence_is_not_valid(drone: Drone) -> None:
    drone.start(height=40.0).assert_ended("NV")


@pytest.mark.parametrize("outside", [(42.5, 8.0, 3.0), (6.0, 8.0, 30.5)])
def test_from_just_outside_the_geofence_it_climbs_and_flies_inside(
    drone: Drone, outside: tuple[float, float, float]
) -> None:
    put(drone, outside)
    drone.start(height=5.0, speed=5.0).assert_ended("S_ARRIVED")
    assert all(Box(FENCE.low, FENCE.high).contains(target) for target, _ in legs(drone))
    assert len(legs(drone)) == 2


def test_interrupted_on_either_leg_it_stops(drone: Drone) -> None:
    for wait in (0.5, 3.0):
        goal = drone.start(height=5.0, speed=1.0)
        drone.run(wait)
        goal.interrupt().assert_ended("IT")
    assert drone.layer.motions.count("Stop") == 2
