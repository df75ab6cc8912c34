"""Places that robots share: never two robots in one place, and nobody waits for ever (docs/fleet.md).

Real managers and missions in virtual time. Whatever is killed, the ground truth of the bodies is what counts.
"""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from toy_yard import GATE, PAD, ROBOTS, SHUTTLE, YARD, ToyYard, places

from law_settings import examples
from skillwing.services.bus import Answer, Refused
from skillwing.services.bus.reading import message_reader
from skillwing.services.client.goal_handle import GoalHandle
from skillwing.services.names import MISSION, RESOURCE_MANAGER, skill_process
from skillwing.services.protocol import ErrorCode, Keys, MissionPhase, MissionStatus, State

PATIENCE = 20.0
LONGEST = 3 * PATIENCE + 120.0
"""Seconds in which every mission has come to its end: three leases, and the ways."""


def until_over(yard: ToyYard, within: float = LONGEST) -> None:
    waiting = [robot for robot, node in yard.missions.items() if not node.over]
    assert yard.network.run_until(lambda: all(node.over for node in yard.missions.values()), within), waiting


def ready(robots: int = 2, *, seed: int = 0, jitter: float = 0.0) -> ToyYard:
    yard = ToyYard(robots, seed=seed, jitter=jitter)
    places = ("pad", "corridor", "charger")
    assert yard.network.run_until(lambda: all(yard.state(place) == "FREE" for place in places), 10.0)
    return yard


@given(seed=st.integers(0, 1000), jitter=st.sampled_from([0.0, 0.02, 0.2]), robots=st.integers(2, 3), data=st.data())
@examples(4)
def test_robots_that_come_at_any_time_visit_the_pad_one_after_the_other(
    seed: int, jitter: float, robots: int, data: st.DataObject
) -> None:
    yard = ready(robots, seed=seed, jitter=jitter)
    for robot in ROBOTS[:robots]:
        yard.network.run_for(data.draw(st.sampled_from([0.0, 0.5, 7.0])))
        yard.fly(robot, patience=120.0)
    until_over(yard, 400.0)
    assert yard.met == []
    assert {robot: node.status.phase for robot, node in yard.missions.items()} == dict.fromkeys(
        ROBOTS[:robots], MissionPhase.SUCCEEDED
    ), [node.status.text for node in yard.missions.values()]
    yard.network.run_for(5.0)
    assert [yard.state(place) for place in ("pad", "corridor")] == ["FREE", "FREE"]


def test_missions_side_by_side_occupy_their_own_robots_and_not_the_yard_that_they_share() -> None:
    yard = ready()
    statuses: dict[str, list[MissionStatus]] = {}
    present: dict[str, set[str]] = {}
    for robot, skillset in (("left", SHUTTLE), ("right", SHUTTLE), ("yard", YARD)):
        observer, keys = yard.network.bus("observer", robot), Keys(skillset.name)
        heard = statuses.setdefault(robot, [])
        observer.subscribe(keys.mission_status, message_reader(MissionStatus, heard.append), events=True)
        seen = present.setdefault(robot, set())
        observer.watch_alive(keys.alive(MISSION), lambda key, alive, seen=seen: seen.add(key) if alive else None)
    for robot in ROBOTS[:2]:
        yard.fly(robot, patience=120.0)
    until_over(yard, 400.0)
    assert {node.status.phase for node in yard.missions.values()} == {MissionPhase.SUCCEEDED}
    assert {robot: bool(heard) for robot, heard in statuses.items()} == {"left": True, "right": True, "yard": False}
    assert {robot: bool(seen) for robot, seen in present.items()} == {"left": True, "right": True, "yard": False}


PROCESSES = [RESOURCE_MANAGER, "places", skill_process("hold_pad"), skill_process("hold_corridor")]
EVENTS = st.one_of(
    st.tuples(st.just("kill"), st.sampled_from(PROCESSES)),
    st.tuples(st.just("start"), st.sampled_from(PROCESSES)),
    st.tuples(st.just("forget"), st.just("")),
    st.tuples(st.just("kill mission"), st.sampled_from(ROBOTS[:2])),
    st.tuples(st.just("kill go"), st.sampled_from(ROBOTS[:2])),
    st.tuples(st.just("fly"), st.sampled_from(ROBOTS[:2])),
)


@given(
    seed=st.integers(0, 1000),
    jitter=st.sampled_from([0.0, 0.02, 0.2]),
    events=st.lists(st.tuples(EVENTS, st.sampled_from([0.3, 1.0, 2.5, 4.0, 12.0])), max_size=10),
)
@examples(7)
def test_whatever_is_killed_two_robots_never_meet_and_every_mission_ends(
    seed: int, jitter: float, events: list[tuple[tuple[str, str], float]]
) -> None:
    yard = ready(seed=seed, jitter=jitter)
    for robot in ROBOTS[:2]:
        yard.fly(robot, PATIENCE)
    yard.network.run_for(3.0)
    for (event, name), seconds in events:
        match event:
            case "kill":
                yard.kill("yard", name)
            case "start":
                yard.start("yard", name)
            case "forget":
                yard.kill("yard", RESOURCE_MANAGER)
                yard.forget()
                yard.start("yard", RESOURCE_MANAGER)
            case "kill mission":
                yard.kill_mission(name)
            case "kill go":
                yard.kill(name, skill_process("go"))
                yard.start(name, skill_process("go"))
            case "fly" if name not in yard.missions:
                yard.fly(name, PATIENCE)
            case _:
                pass
        yard.network.run_for(seconds)
        assert yard.met == []
    until_over(yard)
    assert yard.met == []
    for process in PROCESSES:
        yard.start("yard", process)
    yard.network.run_for(20.0)
    for place in ("pad", "corridor"):
        assert (yard.state(place) == "FREE") == (not yard.inside(place)), (place, yard.state(place))


def test_a_place_is_not_free_while_the_robot_of_a_dead_mission_stands_in_it() -> None:
    yard = ready()
    yard.fly("left", PATIENCE)
    assert yard.network.run_until(lambda: abs(yard.bodies["left"].x - GATE[0]) < 1.0, 60.0)
    yard.kill_mission("left")
    yard.network.run_for(60.0)
    assert [yard.state(place) for place in ("pad", "corridor")] == ["FREE", "UNCLEAR"]
    yard.bodies["left"].x = 20.0
    yard.network.run_for(4.0)
    assert yard.state("corridor") == "FREE"


@pytest.mark.parametrize("killed", ["mission", skill_process("hold_corridor"), RESOURCE_MANAGER])
def test_who_asks_at_every_moment_gets_no_place_with_a_robot_in_it(killed: str) -> None:
    yard = ready()
    yard.fly("left", PATIENCE)
    assert yard.network.run_until(lambda: abs(yard.bodies["left"].x - GATE[0]) < 1.0, 60.0)
    granted: list[float] = []

    def ask() -> None:
        goal = yard.client.start("hold_corridor", {"holder": "right"})
        asked.append(goal)
        granted.extend(yard.bodies["left"].x for each in asked if each.state is State.RUNNING)
        asked[:] = [each for each in asked if not each.done]

    asked: list[GoalHandle] = []
    timer = yard.network.bus("impatient").every(0.02, ask)
    if killed == "mission":
        yard.kill_mission("left")
    else:
        yard.kill("yard", killed)
        yard.network.run_for(0.3)
        yard.start("yard", killed)
    yard.network.run_for(15.0)
    timer.cancel()
    assert all(not places.Place("corridor", (2.0, 0.0), (12.0, 0.0)).covers(x, 0.0) for x in granted), granted


def test_without_the_judge_what_is_held_goes_on_and_nothing_starts() -> None:
    yard = ready()
    yard.fly("left", 200.0)
    assert yard.network.run_until(lambda: yard.state("corridor") == "HELD", 30.0)
    yard.network.run_for(5.0)
    yard.kill("yard", RESOURCE_MANAGER)
    yard.network.run_for(3.0)
    yard.fly("right", 200.0)
    assert yard.network.run_until(lambda: (yard.bodies["left"].x, yard.bodies["left"].y) == PAD, 30.0)
    yard.network.run_for(8.0)
    assert yard.bodies["right"].x == 20.0
    yard.start("yard", RESOURCE_MANAGER)
    until_over(yard, 500.0)
    assert yard.met == []


def test_a_lease_that_ends_before_its_robot_is_in_the_place_stops_the_robot() -> None:
    yard = ready()
    yard.fly("left", PATIENCE)
    assert yard.network.run_until(lambda: yard.bodies["left"].x < 19.0, 30.0)
    yard.kill("yard", skill_process("hold_corridor"))
    yard.network.run_for(5.0)
    left = yard.bodies["left"]
    assert not left.moves
    assert left.x > 13.0
    assert yard.network.run_until(lambda: yard.state("corridor") == "FREE", 10.0)


def test_a_lease_that_ends_while_its_robot_is_in_the_place_lets_it_leave() -> None:
    yard = ready()
    yard.fly("left", PATIENCE)
    assert yard.network.run_until(lambda: abs(yard.bodies["left"].x - GATE[0]) < 1.0, 60.0)
    yard.kill("yard", skill_process("hold_corridor"))
    assert yard.network.run_until(lambda: (yard.bodies["left"].x, yard.bodies["left"].y) == PAD, 20.0)
    assert yard.state("corridor") in ("UNCLEAR", "FREE")
    assert yard.network.run_until(lambda: yard.state("corridor") == "FREE", 10.0)


@pytest.mark.parametrize("seed", range(6))
def test_a_lease_of_the_pad_that_ends_on_the_way_there_lets_no_second_robot_in(seed: int) -> None:
    """The pad is empty then, so another robot gets it. The first one is in the corridor, under the lease of that."""
    yard = ready(seed=seed, jitter=0.2)
    yard.fly("left", PATIENCE)
    assert yard.network.run_until(lambda: bool(yard.inside("corridor")), 60.0)
    yard.kill("yard", skill_process("hold_pad"))
    yard.start("yard", skill_process("hold_pad"))
    yard.network.run_for(2.0)
    assert not yard.bodies["left"].moves
    yard.fly("right", 60.0)
    until_over(yard, 400.0)
    assert yard.met == []


def test_a_robot_without_a_lease_makes_a_free_place_unclear() -> None:
    yard = ready()
    yard.bodies["right"].x, yard.bodies["right"].y = PAD
    yard.network.run_for(2.0)
    assert yard.state("pad") == "UNCLEAR"
    yard.fly("left", 10.0)
    until_over(yard, 60.0)
    assert "hold_pad was not granted within 10 s" in yard.missions["left"].status.text


def test_a_second_robot_in_a_held_place_ends_the_lease_and_halts_its_mission() -> None:
    yard = ready()
    yard.fly("left", PATIENCE)
    left, right = yard.bodies["left"], yard.bodies["right"]
    assert yard.network.run_until(lambda: left.x < 1.5, 60.0)
    assert yard.state("pad") == "HELD"
    right.x, right.y = PAD[0] - 1.0, PAD[1]
    yard.network.run_for(1.0)
    assert yard.state("pad") == "UNCLEAR"
    yard.network.run_for(10.0)
    assert not left.moves
    assert yard.missions["left"].status.phase is MissionPhase.FAILED
    assert yard.state("pad") == "UNCLEAR"


def test_a_robot_that_is_not_heard_keeps_an_unclear_place_until_an_operator_frees_it() -> None:
    yard = ready()
    yard.kill("right", "vehicle")
    answers: list[Answer] = []
    yard.client.trigger("pad", "UNCLEAR", answers.append)
    yard.network.run_for(20.0)
    assert yard.state("pad") == "UNCLEAR"
    yard.client.fire("pad_cleared", answers.append)
    yard.network.run_for(1.0)
    assert isinstance(answers[-1], Refused)
    assert answers[-1].error.code is ErrorCode.NOT_ALLOWED
    yard.client.trigger("pad", "FREE", answers.append)
    yard.network.run_for(1.0)
    assert yard.state("pad") == "FREE"


@pytest.mark.parametrize("swapped", [False, True])
def test_places_taken_in_one_order_never_block_each_other(swapped: bool) -> None:
    """Robots that take them in opposite orders do. Their patience ends that, with a failure."""
    yard = ready()
    yard.fly("left", 60.0)
    assert yard.network.run_until(lambda: (yard.bodies["left"].x, yard.bodies["left"].y) == PAD, 60.0)
    yard.fly("right", 60.0, swapped=swapped)
    until_over(yard, 400.0)
    phases = {node.status.phase for node in yard.missions.values()}
    assert (phases == {MissionPhase.SUCCEEDED}) is not swapped
    assert yard.met == []
