"""Flights of two drones in one world: their plans, and the same flight each time."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from skillwing.evaluation.fleet.flight import fly_fleet, processes
from skillwing.evaluation.fleet.plan import LEFT, RIGHT, ROBOTS, WORLD, FleetCondition, FleetPlan, halves
from skillwing.evaluation.fleet.result import FleetResult, RobotResult
from skillwing.evaluation.flights.result import End
from skillwing.services.errors import InvalidOptionError
from skillwing.services.history.files import TIMELINE_FILE
from skillwing.sim_mujoco.world.kinds import make_site

PLANS = st.builds(FleetPlan, seed=st.integers(0, 10_000), condition=st.sampled_from(list(FleetCondition)))
APART = 9.0
"""Distance between the halves away from the pad [m]."""
NEAR_PAD = 8.0


@given(PLANS)
def test_a_condition_concerns_one_robot_and_the_first_one_has_the_simulator(plan: FleetPlan) -> None:
    drones = plan.robot_options(LEFT)["robots"]
    assert tuple(drones) == ROBOTS
    with_faults = [robot for robot, own in drones.items() if own.get("faults")]
    assert with_faults == ([plan.hit] if plan.condition is FleetCondition.CAMERA else [])
    cut = [robot for robot in ROBOTS if plan.cut(robot) is not None]
    assert cut == ([plan.hit] if plan.condition is FleetCondition.LINK else [])
    names = {robot: [spec.name for spec in processes(plan, robot, None)] for robot in ROBOTS}
    assert names[LEFT].count("sim") == 1
    assert "sim" not in names[RIGHT]


def test_the_halves_are_apart_away_from_the_pad() -> None:
    routes = halves(make_site(1, WORLD))

    def points(robot: str) -> list[tuple[float, ...]]:
        return [
            tuple(a + share / 20.0 * (b - a) for a, b in zip(start, end, strict=True))
            for start, end in pairwise(routes[robot])
            for share in range(21)
        ]

    for one in points(LEFT):
        for other in points(RIGHT):
            near_pad = math.hypot(*one[:2]) < NEAR_PAD or math.hypot(*other[:2]) < NEAR_PAD
            assert near_pad or math.dist(one, other) >= APART


def test_only_a_courtyard_is_divided() -> None:
    with pytest.raises(InvalidOptionError, match="Two drones divide a courtyard, not a village"):
        halves(make_site(1, "village"))


@pytest.mark.parametrize(
    ("left", "right", "kept"),
    [
        (RobotResult(end=End.HOME), RobotResult(end=End.ELSEWHERE), True),
        (RobotResult(end=End.HOME, collisions=1), RobotResult(end=End.HOME), False),
        (RobotResult(end=End.HOME), RobotResult(end=End.HOME, breaches=1), False),
        (RobotResult(end=End.FLYING), RobotResult(end=End.HOME), False),
    ],
)
def test_the_promise_holds_for_both_drones(left: RobotResult, right: RobotResult, kept: bool) -> None:
    result = FleetResult(plan=FleetPlan(seed=1), robots={LEFT: left, RIGHT: right})
    assert result.kept is kept


@pytest.mark.slow
def test_the_same_plan_is_the_same_flight_of_both_drones_bit_by_bit(tmp_path: Path) -> None:
    """Up to the take-off. The second flight is recorded, which changes nothing."""
    plan = FleetPlan(seed=1)
    first, again = fly_fleet(plan, longest=4.0), fly_fleet(plan, tmp_path, longest=4.0)
    assert first.error == again.error == ""
    assert {robot: each.digest for robot, each in first.robots.items()} == {
        robot: each.digest for robot, each in again.robots.items()
    }
    assert first.separation == again.separation
    assert first.separation is not None
    assert 3.0 < first.separation < 7.0
    assert all(each.end is End.FLYING and not each.collisions for each in first.robots.values())
    assert all((tmp_path / robot / TIMELINE_FILE).stat().st_size > 0 for robot in ROBOTS)
