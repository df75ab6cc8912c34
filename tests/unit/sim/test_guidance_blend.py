"""Guidance with a new target aside of a flight: it turns without a stop where that is safe."""

from __future__ import annotations

import math
from collections.abc import Callable
from copy import deepcopy
from dataclasses import replace
from functools import cache
from itertools import pairwise

import pytest
from flight_rig import WORLD, Rig

from skillwing.onboard.frames.vectors import Vector
from skillwing.onboard.guidance.path_monitor import LEAST_MARGIN
from skillwing.onboard.guidance.trajectory import BRAKING
from skillwing.onboard.topics.guidance import FlyTo, GuidanceStatus, MotionState, Stop, YawMode
from skillwing.onboard.topics.obstacles import ObstacleSource, ObstacleStatus

Report = Callable[[float, GuidanceStatus], ObstacleStatus]


def to(x: float, y: float, z: float = 4.0, speed: float = 2.0, nose: YawMode = YawMode.FREE) -> FlyTo:
    return FlyTo(target=(x, y, z), speed=speed, nose=nose)


def under_way(report: Report | None = None) -> Rig:
    """Rig in a flight to the east at 2 m/s."""
    rig = deepcopy(_above_open_ground())
    if report is not None:
        rig.obstacles = report
        rig.fly(0.2)
    rig.command("a", to(12.0, 0.0))
    assert rig.fly(10.0, lambda: rig.sim.motion.position[0] > 2.5)
    assert speed_of(rig) > 1.8
    return rig


@cache
def _above_open_ground() -> Rig:
    rig = Rig(replace(WORLD, obstacles=()))
    rig.take_off()
    return rig


def speed_of(rig: Rig) -> float:
    return math.hypot(*rig.sim.motion.velocity)


def slowest(rig: Rig, until: Callable[[], bool]) -> float:
    """Least speed of the drone until the condition holds."""
    speeds: list[float] = []

    def look() -> bool:
        speeds.append(speed_of(rig))
        return until()

    assert rig.fly(20.0, look), rig.status
    return min(speeds)


def close_to(rig: Rig, x: float, y: float, z: float = 4.0, within: float = 2.0) -> Callable[[], bool]:
    return lambda: math.dist(rig.sim.motion.position, (x, y, z)) < within


def seen(free: Callable[[float, tuple[Vector, ...]], float | None], horizon: float = 14.0) -> Report:
    """Reports of a camera about the way: free metres of it, by time and corners."""

    def report(t: float, status: GuidanceStatus) -> ObstacleStatus:
        way = () if status.target is None else status.way or (status.target,)
        return ObstacleStatus(
            t=t,
            source=ObstacleSource.ZED,
            free_distance=free(t, (status.setpoint, *way)) if way else None,
            horizon=horizon,
            ahead=None,
            stamp=t - 0.1,
        )

    return report


def wall_north(y: float) -> Callable[[float, tuple[Vector, ...]], float]:
    """Free metres to a wall at `y`, of ways that lead east and then north."""

    def free(_: float, corners: tuple[Vector, ...]) -> float:
        flown = 0.0
        for a, b in pairwise(corners):
            length = math.dist(a, b)
            if b[1] >= y:
                return flown + length * (y - a[1]) / (b[1] - a[1])
            flown += length
        return 20.0

    return free


@pytest.mark.parametrize(
    ("target", "slow"), [((8.0, 4.0), 0.7), ((5.0, 9.0), 0.7), ((6.0, -4.0), 0.7)], ids=["ahead", "left", "right"]
)
def test_an_unwatched_flight_goes_on_aside_without_a_stop(target: tuple[float, float], slow: float) -> None:
    rig = under_way()
    rig.command("a", to(*target))
    assert slowest(rig, close_to(rig, *target)) > slow
    rig.fly_until(MotionState.DONE)
    assert math.dist(rig.sim.motion.position, (*target, 4.0)) < 0.3


@pytest.mark.parametrize("motion", [to(-6.0, 1.0), to(8.0, 4.0, nose=YawMode.ALONG_TRACK)], ids=["behind", "nose"])
def test_other_flights_begin_at_rest(motion: FlyTo) -> None:
    rig = under_way()
    rig.command("a", motion)
    assert slowest(rig, lambda: rig.status.body.state is not MotionState.STOPPING) < 0.3
    rig.fly_until(MotionState.DONE)
    assert math.dist(rig.sim.motion.position, motion.target) < 0.3


def test_the_way_over_the_corner_is_looked_at_before_and_in_the_turn() -> None:
    rig = under_way(seen(lambda t, corners: 20.0))
    rig.command("a", to(7.0, 8.0))
    corner, end = rig.status.way
    assert end == rig.status.target == (7.0, 8.0, 4.0)
    assert corner == pytest.approx((rig.status.setpoint[0] + 2.0**2 / (2 * BRAKING), 0.0, 4.0), abs=0.1)
    began = rig.sim.t
    slow = slowest(rig, lambda: rig.status.body.state is MotionState.MOVING)
    assert 0.3 < rig.sim.t - began < 0.6
    assert len(rig.status.way) == 2
    assert min(slow, slowest(rig, close_to(rig, 7.0, 8.0))) > 0.7
    assert rig.status.way == ()
    rig.fly_until(MotionState.DONE)


def test_a_way_out_of_view_begins_at_rest() -> None:
    rig = under_way(seen(lambda t, corners: 20.0 if corners[-1][1] == 0.0 else None))
    rig.command("a", to(7.0, 8.0))
    assert slowest(rig, lambda: rig.status.body.state is MotionState.MOVING) < 0.3
    rig.fly_until(MotionState.DONE)


def test_a_view_that_ends_at_the_corner_is_none() -> None:
    rig = under_way(seen(lambda t, corners: 20.0))
    rig.obstacles = seen(lambda t, corners: 20.0, horizon=2.0)
    rig.command("a", to(7.0, 8.0))
    assert slowest(rig, lambda: rig.status.body.state is MotionState.MOVING) < 0.3


def test_a_blocked_way_does_not_begin_before_the_drone_is_at_rest() -> None:
    rig = under_way(seen(lambda t, corners: 20.0))
    rig.obstacles = seen(wall_north(2.0))
    rig.command("a", to(7.0, 8.0))
    assert slowest(rig, lambda: rig.status.body.state is MotionState.MOVING) < 0.3
    rig.fly_until(MotionState.BLOCKED)
    assert rig.sim.motion.position[1] < 2.0 - LEAST_MARGIN


@pytest.mark.parametrize("later", [0.0, 0.3, 0.6, 0.9, 1.2])
def test_an_obstacle_that_appears_in_the_turn_stops_the_drone(later: float) -> None:
    rig = under_way(seen(lambda t, corners: 20.0))
    rig.command("a", to(6.0, 9.0))
    rig.fly_until(MotionState.MOVING, seconds=2.0)
    rig.fly(later)
    wall = rig.sim.motion.position[1] + 4.2
    rig.obstacles = seen(wall_north(wall))
    rig.fly_until(MotionState.BLOCKED, seconds=10.0)
    assert wall - rig.sim.motion.position[1] > LEAST_MARGIN
    assert abs(rig.sim.motion.position[0] - rig.status.setpoint[0]) < 0.3


def test_a_view_lost_in_the_turn_brings_the_drone_to_rest_and_then_the_usual_way() -> None:
    rig = under_way(seen(lambda t, corners: 20.0))
    rig.command("a", to(7.0, 8.0))
    rig.fly_until(MotionState.MOVING, seconds=2.0)
    rig.obstacles = seen(lambda t, corners: None)
    rig.fly_until(MotionState.STOPPING, seconds=0.2)
    assert slowest(rig, lambda: rig.status.body.state is MotionState.MOVING) < 0.3
    rig.fly_until(MotionState.DONE)


@pytest.mark.parametrize("later", [0.1, 0.5, 0.8, 1.2, 1.6])
def test_a_stop_brakes_before_the_turn_and_in_it(later: float) -> None:
    rig = under_way()
    rig.command("a", to(7.0, 8.0), token=10)
    rig.fly(later)
    rig.command("a", Stop(), token=10)
    assert rig.status.body.state is MotionState.STOPPING
    rig.fly_until(MotionState.STOPPED, seconds=3.0)
    assert speed_of(rig) < 0.3
    assert rig.status.target is None
    where = rig.sim.motion.position
    rig.fly(1.0)
    assert math.dist(where, rig.sim.motion.position) < 0.3


@pytest.mark.parametrize("later", [0.1, 1.6])
def test_one_new_target_after_another_keeps_the_drone_moving(later: float) -> None:
    rig = under_way()
    rig.command("a", to(8.0, 5.0))
    rig.fly(later)
    rig.command("a", to(11.0, 2.0))
    assert slowest(rig, close_to(rig, 11.0, 2.0)) > 0.35
    rig.fly_until(MotionState.DONE)
    assert math.dist(rig.sim.motion.position, (11.0, 2.0, 4.0)) < 0.3


def test_a_new_target_in_the_turn_is_flown_to_after_it() -> None:
    rig = under_way()
    rig.command("a", to(8.0, 5.0))
    rig.fly_until(MotionState.MOVING, seconds=2.0)
    rig.fly(0.3)
    rig.command("a", to(11.0, 2.0))
    assert len(rig.status.way) == 3
    rig.fly_until(MotionState.DONE)
    assert math.dist(rig.sim.motion.position, (11.0, 2.0, 4.0)) < 0.3
