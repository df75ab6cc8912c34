"""Flights of two drones in one world: their plans, and the same flight each time."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from skillwing.evaluation.fleet.flight import fly_fleet, processes
from skillwing.evaluation.fleet.plan import LEFT, RIGHT, ROBOTS, WORLD, FleetCondition, FleetPlan, halves
from skillwing.evaluation.fleet.result import FleetResult, RobotResult
from skillwing.evaluation.fleet.yard import PLACES, YARD, YardWitness
from skillwing.evaluation.flights.result import End
from skillwing.onboard.topics.truth import Truth
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.errors import InvalidOptionError
from skillwing.services.history.files import TIMELINE_FILE
from skillwing.services.names import MISSION, RESOURCE_MANAGER
from skillwing.services.protocol import GoalStatus, Keys, MissionPhase, State, encode
from skillwing.sim_mujoco.world.kinds import make_site

PLANS = st.builds(FleetPlan, seed=st.integers(0, 10_000), condition=st.sampled_from(list(FleetCondition)))
APART = 9.0
"""Distance between the halves away from the pad [m]."""
NEAR_PAD = 8.0
ASIDE = 0.8
"""Least distance between a planned way of mapping and a place, on each axis [m]."""
SUCCEEDED = MissionPhase.SUCCEEDED


@given(PLANS)
def test_a_condition_concerns_one_robot_and_the_first_one_has_the_simulator(plan: FleetPlan) -> None:
    drones = plan.robot_options(LEFT)["robots"]
    assert tuple(drones) == ROBOTS
    with_faults = [robot for robot, own in drones.items() if own.get("faults")]
    assert with_faults == ([plan.hit] if plan.condition is FleetCondition.CAMERA else [])
    killed = None if (kill := plan.kill()) is None else (kill.robot, kill.process)
    expected = {FleetCondition.LINK: (plan.hit, MISSION), FleetCondition.JUDGE: (YARD, RESOURCE_MANAGER)}
    assert killed == expected.get(plan.condition)
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


def test_no_planned_way_of_mapping_comes_near_a_place() -> None:
    plan = FleetPlan(seed=1)
    for robot in ROBOTS:
        for start, end in pairwise(plan.way(robot)):
            for share in range(401):
                x, y = (a + share / 400.0 * (b - a) for a, b in zip(start[:2], end[:2], strict=True))
                for place, (west, south, east, north) in PLACES.items():
                    near = west - ASIDE <= x <= east + ASIDE and south - ASIDE <= y <= north + ASIDE
                    assert not near, (robot, place, x, y)


def test_only_a_courtyard_is_divided() -> None:
    with pytest.raises(InvalidOptionError, match="Two drones divide a courtyard, not a village"):
        halves(make_site(1, "village"))


def flown(**parts: Any) -> RobotResult:
    return RobotResult(**{"end": End.HOME, "phase": SUCCEEDED} | parts)


@pytest.mark.parametrize(
    ("left", "right", "kept"),
    [
        (flown(), flown(end=End.ELSEWHERE), True),
        (flown(collisions=1), flown(), False),
        (flown(), flown(breaches=1), False),
        (flown(end=End.FLYING), flown(), False),
        (flown(), flown(phase="RUNNING"), False),
        (flown(), flown(phase=""), False),
        (flown(), flown(phase="FAILED"), True),
    ],
)
def test_the_promise_holds_for_both_drones(left: RobotResult, right: RobotResult, kept: bool) -> None:
    plan = FleetPlan(seed=1, condition=FleetCondition.CAMERA)
    assert FleetResult(plan=plan, robots={LEFT: left, RIGHT: right}).kept is kept


def test_where_nothing_goes_wrong_both_visit_the_pad() -> None:
    both = {LEFT: flown(), RIGHT: flown()}
    plan = FleetPlan(seed=1)
    assert FleetResult(plan=plan, robots=both, visits=dict.fromkeys(ROBOTS, 1)).kept
    assert not FleetResult(plan=plan, robots=both, visits={LEFT: 1, RIGHT: 0}).kept
    failed = both | {RIGHT: flown(phase="FAILED")}
    assert not FleetResult(plan=plan, robots=failed, visits=dict.fromkeys(ROBOTS, 1)).kept


def test_only_a_killed_mission_may_have_no_end() -> None:
    plan = FleetPlan(seed=1, condition=FleetCondition.LINK)
    for robot in ROBOTS:
        robots = {each: flown(phase="RUNNING" if each == robot else SUCCEEDED) for each in ROBOTS}
        assert FleetResult(plan=plan, robots=robots).kept is (robot == plan.hit)


@pytest.mark.parametrize("broken", [{"met": 1}, {"history": "not linearizable"}])
def test_two_drones_on_the_pad_and_a_wrong_history_break_the_promise(broken: dict[str, Any]) -> None:
    plan = FleetPlan(seed=1, condition=FleetCondition.CAMERA)
    robots = {robot: flown() for robot in ROBOTS}
    assert FleetResult(plan=plan, robots=robots).kept
    assert not FleetResult(plan=plan, robots=robots, **broken).kept


def truth(t: float, x: float, y: float, z: float) -> Truth:
    return Truth(
        t=t,
        position=(x, y, z),
        quaternion=(1.0, 0.0, 0.0, 0.0),
        velocity=(0.0, 0.0, 0.0),
        collisions=0,
        clearance=1.0,
        inside_fence=True,
    )


def test_the_witness_sees_two_drones_on_the_pad_at_one_moment_only() -> None:
    witness = YardWitness(ROBOTS)
    witness.take(LEFT, truth(1.0, 0.0, 0.0, 0.5))
    witness.take(RIGHT, truth(1.0, 0.0, -4.0, 0.5))
    witness.take(RIGHT, truth(9.0, 0.0, -1.0, 4.0))
    assert witness.met == []
    assert witness.visits == {LEFT: 1, RIGHT: 0}
    witness.take(LEFT, truth(9.0, 1.0, 1.0, 0.5))
    assert witness.met == [9.0]


def test_the_witness_sees_two_drones_in_the_corridor() -> None:
    witness = YardWitness(ROBOTS)
    witness.take(LEFT, truth(1.0, 4.0, 0.0, 4.0))
    witness.take(RIGHT, truth(1.0, 2.0, 0.0, 4.0))
    assert witness.met == []
    witness.take(RIGHT, truth(2.0, 5.0, 0.5, 12.0))
    assert witness.met == []
    witness.take(LEFT, truth(2.0, 4.0, 0.0, 4.0))
    assert witness.met == [2.0]
    assert not any(witness.visits.values())


def test_the_witness_knows_whether_the_pad_was_held_at_the_kill() -> None:
    network = InProcessNetwork()
    witness = YardWitness(ROBOTS)
    network.attach(witness, YARD)
    keys = Keys(YARD)
    out = network.bus("hold_pad", YARD).advertise(keys.status("hold_pad"), events=True)

    def publish(state: State) -> None:
        status = GoalStatus(goal_id="one", skill="hold_pad", state=state, t=0.0, record="r", source="s", before="IDLE")
        out.put(encode(status))
        network.run_for(0.1)

    witness.note_kill()
    assert witness.held_at_kill is False
    publish(State.RUNNING)
    witness.note_kill()
    assert witness.held_at_kill is True
    publish(State.TERMINATED)
    witness.note_kill()
    assert witness.held_at_kill is False


@pytest.mark.slow
def test_the_same_plan_is_the_same_flight_of_both_drones_bit_by_bit(tmp_path: Path) -> None:
    """Up to the begin of mapping. The second flight is recorded, which changes nothing."""
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
