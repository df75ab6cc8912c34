"""The process around a mission: waiting, abort, giving up, and its messages."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar, TypeAlias

import pytest
from flights import KEYS, M600, M600_FILE, Flight
from hypothesis import given, settings
from hypothesis import strategies as st
from py_trees.behaviour import Behaviour
from py_trees.behaviours import Failure, StatusQueue, Success
from py_trees.common import Status
from py_trees.decorators import FailureIsSuccess, SuccessIsFailure

from skillwing.bt_missions.cli.foreground import call_when_stopped
from skillwing.bt_missions.drone.flight import land_where_it_is
from skillwing.bt_missions.leaves.branch_switch import NoteSwitch
from skillwing.bt_missions.leaves.conditions import ResourceIs
from skillwing.bt_missions.leaves.context import MissionContext
from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.bt_missions.mission.mission import Mission, MissionOptions, MissionTrees, Progress
from skillwing.bt_missions.running import mission_run
from skillwing.bt_missions.running.runner import AWAY_TIMEOUT, MissionNode, make_mission
from skillwing.bt_missions.subtrees.composites import alongside, first_that_works, guarded, in_order
from skillwing.dsl.model import UnknownNameError
from skillwing.m600.robot import ROBOT
from skillwing.services.bus import Answer, Answered, Bus, Handle, Refused
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.client.connection import Target
from skillwing.services.client.interface import SkillsetInterface
from skillwing.services.errors import InvalidOptionError
from skillwing.services.processes.run_state import announced
from skillwing.services.protocol import (
    AbortMission,
    MissionStatus,
    PauseMission,
    RecordKind,
    ResumeMission,
    decode,
    encode,
)
from skillwing.services.robot import find_robot

TIDY = {"max_examples": 8, "deadline": None}


Make: TypeAlias = Callable[[MissionContext], Behaviour]
HOP = [Status.RUNNING] * 40 + [Status.SUCCESS]


class StillBus:
    """A bus whose robot time stops at a moment, as when the simulator hangs."""

    def __init__(self, bus: Bus, at: float) -> None:
        self._bus = bus
        self._at = at

    def now(self) -> float:
        return min(self._bus.now(), self._at)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._bus, name)


class LateBus:
    """A bus that receives robot time late, as in a process that has just joined: before `at`, its time is 0."""

    def __init__(self, bus: Bus, at: float) -> None:
        self._bus = bus
        self._at = at

    def now(self) -> float:
        return self._bus.now() if self._bus.now() >= self._at else 0.0

    def after(self, delay: float, action: Callable[[], None], *, wall: bool = False) -> Handle:
        return self._bus.after(delay if wall else max(delay, self._at - self._bus.now()), action, wall=wall)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._bus, name)


class Raising(Behaviour):
    """A leaf with a programming error."""

    def update(self) -> Status:
        raise ZeroDivisionError("division by zero")


class Failed(Behaviour):
    """A leaf that fails for a reason."""

    def __init__(self, context: MissionContext, reason: str) -> None:
        super().__init__("failed")
        self._context = context
        self._reason = reason

    def update(self) -> Status:
        self._context.observe(self._reason, None, failed=True)
        return Status.FAILURE


class Closed(Behaviour):
    """A leaf that runs a tree of its own, which checks before the flight cannot see."""

    def __init__(self, tree: Behaviour) -> None:
        super().__init__(tree.name)
        self.tree = tree

    def update(self) -> Status:
        self.tree.tick_once()
        return self.tree.status


class ShortHop(Mission):
    """Mission that takes off, does what the test says, and lands. whole: another tree in its place."""

    name = "hop"
    summary = "Take off and see."
    needs: ClassVar[dict[str, tuple[str, ...]]] = {"SDK_authority": ("AVAILABLE",), "homepoint_status": ("VALID",)}

    def __init__(self, *then: Make, rescue: bool = True, whole: Make | None = None) -> None:
        self.then = then
        self.can_rescue = rescue
        self.whole = whole

    def build(self, context: MissionContext, options: Any) -> MissionTrees:
        rescue = land_where_it_is(context)
        if not self.can_rescue:
            rescue = in_order("rescue", FailureIsSuccess("try", Raising("raises")), rescue)
        flight = in_order("hop", take_off(context), *(make(context) for make in self.then), land(context))
        failed = SuccessIsFailure("landed, but not done", land_where_it_is(context))
        tree = first_that_works("hop or land", flight, failed) if self.whole is None else self.whole(context)
        return MissionTrees(tree, rescue, Progress)


class WithoutProgress(ShortHop):
    """Mission whose function `progress` has a programming error."""

    def build(self, context: MissionContext, options: Any) -> MissionTrees:
        return replace(super().build(context, options), progress=lambda: Progress(waypoints=1 // 0))


class FromTheAir(ShortHop):
    needs: ClassVar[dict[str, tuple[str, ...]]] = {"flight_status": ("IN_AIR",)}


def take_off(context: MissionContext) -> Behaviour:
    return SkillAction("takeoff", context, "takeoff", {"height": 4.0})


def land(context: MissionContext) -> Behaviour:
    return SkillAction("land", context, "land", {"speed": 2.0})


def hop(*then: Make, rescue: bool = True) -> Flight:
    return Flight(mission=ShortHop(*then, rescue=rescue))


def raising(context: MissionContext) -> Behaviour:
    return Raising("raises")


def hold(context: MissionContext) -> Behaviour:
    return FailureIsSuccess("held", SkillAction("hold", context, "lidar_mapping"))


# --- before the flight -----------------------------------------------------------------------------------------------


def test_a_mission_begins_when_it_knows_the_time() -> None:
    """Robot time is the time of a mission's messages and of its goals' deadlines."""
    flight = hop()
    flight.fly()
    begun = flight.network.now()
    node = MissionNode(ShortHop(), M600, MissionOptions(), rescue_goal=ROBOT.rescue_goal)
    node.attach(LateBus(flight.network.bus("late"), at=begun + 5.0))
    flight.network.run_for(4.0)
    assert (node.status.phase, node.status.text) == ("IDLE", "waiting for the robot's clock")
    flight.until(lambda: node.over)
    flight.network.run_for(0.5)
    assert node.status.phase == "SUCCEEDED"
    phases = [record for record in flight.records if record.source == "late" and record.subject == "hop"]
    assert [record.after for record in phases] == ["RUNNING", "SUCCEEDED"]
    assert phases[0].t == pytest.approx(begun + 5.0, abs=0.3)


def test_a_robot_that_is_not_ready_is_waited_for() -> None:
    flight = Flight()
    flight.drone.truth["SDK_authority"] = "UNAVAILABLE"
    flight.at(10.0, lambda: flight.drone.set("SDK_authority", "AVAILABLE"))
    flight.network.run_for(5.0)
    assert (flight.node.status.phase, flight.started) == ("IDLE", [])
    assert "SDK_authority is UNAVAILABLE instead of AVAILABLE" in flight.node.status.text
    assert flight.fly().phase == "SUCCEEDED"


def test_a_robot_that_does_not_get_ready_is_given_up_with_a_sentence() -> None:
    flight = Flight(ready_timeout=5.0)
    flight.drone.truth["lidar_status"] = "FAILED"
    status = flight.fly()
    assert status.phase == "FAILED"
    assert "within 5 s" in status.text
    assert "lidar_status is FAILED instead of OK" in status.text
    assert flight.started == []


def in_the_air(**options: Any) -> Flight:
    flight = Flight(**options)
    flight.drone.position = (0.0, 0.0, 4.0)
    flight.drone.truth["flight_status"] = "IN_AIR"
    return flight


def test_a_drone_in_the_air_that_nobody_flies_is_not_waited_for() -> None:
    flight = in_the_air()
    status = flight.fly(timeout=AWAY_TIMEOUT + 1.0)
    assert status.phase == "FAILED"
    assert status.text.endswith("nobody commands it. Use `skillwing start land`.")
    assert flight.started == []
    assert not flight.node.tree_shows_end


def test_a_drone_that_is_landing_is_waited_for() -> None:
    flight = in_the_air()
    operator = SkillsetInterface(flight.observer, M600, client="operator")
    flight.at(1.0, lambda: operator.start("land", {"speed": 0.5}))
    assert flight.fly().phase == "SUCCEEDED"
    assert flight.ends("land") == ["S_LANDED", "S_LANDED"]


def test_a_robot_without_managers_is_given_up_too() -> None:
    """The setup of py_trees_ros waits for a server without limit by default."""
    flight = Flight(ready_timeout=5.0)
    flight.buses["resource_manager"].close()
    flight.until(lambda: flight.node.over)
    assert "waiting for the resource manager" in flight.node.status.text


def test_a_mission_that_does_not_fit_is_refused_with_all_its_problems() -> None:
    flight = hop(
        lambda context: SkillAction("a", context, "teleport"),
        lambda context: SkillAction("b", context, "goto", {"speed": 99.0, "target": {"x": 0.0, "y": 0.0, "z": 1.0}}),
    )
    status = flight.fly()
    assert status.phase == "FAILED"
    first, *problems = status.text.splitlines()
    assert first == "The mission does not fit this robot:"
    assert len(problems) == 2, "one line each"
    assert all(f"{__file__}:" in problem for problem in problems)
    assert "teleport" in problems[0]
    assert "speed" in problems[1]
    assert flight.started == []


# --- abort -----------------------------------------------------------------------------------------------------------


def call_off(flight: Flight, reason: str = "the wind gets up") -> list[Answer]:
    answers: list[Answer] = []
    flight.observer.ask(KEYS.mission_abort, encode(AbortMission(reason=reason)), answers.append)
    return answers


@given(moment=st.floats(0.0, 40.0), seed=st.integers(0, 1000))
@settings(**TIDY)
def test_an_abort_at_any_time_brings_the_drone_down(moment: float, seed: int) -> None:
    flight = Flight(seed=seed)
    flight.at(moment, lambda: call_off(flight))
    flight.at(moment + 0.1, lambda: call_off(flight, "again"))
    status = flight.fly()
    assert status.phase in ("ABORTED", "SUCCEEDED")
    if status.phase == "ABORTED":
        assert status.text.startswith("the wind gets up")
    assert flight.idle
    assert flight.on_ground


def test_an_abort_is_answered_and_a_malformed_one_refused() -> None:
    flight = hop(hold)
    flight.network.run_for(10.0)
    refused: list[Answer] = []
    flight.observer.ask(KEYS.mission_abort, b"\xc1", refused.append)
    flight.network.run_for(0.1)
    assert isinstance(refused[0], Refused)
    assert flight.node.status.phase == "RUNNING"
    answers = call_off(flight)
    flight.network.run_for(0.1)
    assert isinstance(answers[0], Answered)
    told = decode(answers[0].payload, MissionStatus)
    assert (told.mission, told.phase, told.text) == ("hop", "RUNNING", "the wind gets up; landing")
    assert flight.fly().text == "the wind gets up; the robot is on the ground"


def test_an_abort_before_the_flight_starts_nothing() -> None:
    flight = Flight()
    flight.drone.truth["SDK_authority"] = "UNAVAILABLE"
    flight.network.run_for(1.0)
    answers = call_off(flight)
    flight.network.run_for(0.1)
    assert decode(answers[0].payload, MissionStatus).text == "the wind gets up"
    assert flight.fly().phase == "ABORTED"
    assert flight.started == []


def test_a_process_that_is_stopped_says_its_last_words_and_interrupts() -> None:
    flight = hop(hold)
    flight.network.run_for(10.0)
    flight.node.detach()
    assert flight.fly().phase == "ABORTED"
    assert flight.ends("lidar_mapping") == ["IT"]


@pytest.mark.parametrize(("moment", "where"), [(0.05, ""), (10.0, ", with the robot in the air")])
def test_a_mission_ends_at_once_when_the_system_under_it_is_stopped(moment: float, where: str) -> None:
    flight = hop(hold)
    flight.network.run_for(moment)
    flight.node.system_stopped()
    assert flight.node.over
    assert flight.node.status.phase == "ABORTED"
    assert flight.node.status.text == f"the system was stopped under it{where}"
    assert not flight.node.tree_shows_end


def test_a_failure_before_the_system_was_stopped_is_reported() -> None:
    flight = hop(hold)
    flight.network.run_for(10.0)
    call_off(flight)
    flight.network.run_for(0.1)
    flight.node.system_stopped()
    assert flight.node.status.text.endswith("; before that: the wind gets up")


def test_it_is_noticed_that_a_system_is_stopped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    network, stopped = InProcessNetwork(seed=0), []
    target = Target("m600", "tcp/127.0.0.1:1", M600_FILE, "robot", pid=os.getpid())
    with announced(find_robot("m600"), target.endpoint, tmp_path):
        call_when_stopped(network.bus("mission"), target, lambda: stopped.append(network.now()))
        network.run_for(3.0)
        assert stopped == []
    network.run_for(3.0)
    assert len(stopped) == 1


# --- pause -----------------------------------------------------------------------------------------------------------


def order(flight: Flight, key: str, message: PauseMission | ResumeMission) -> Answer:
    answers: list[Answer] = []
    flight.observer.ask(key, encode(message), answers.append)
    flight.network.run_for(0.1)
    return answers[0]


def pause(flight: Flight) -> Answer:
    return order(flight, KEYS.mission_pause, PauseMission(reason="somebody walks there"))


def resume(flight: Flight) -> Answer:
    return order(flight, KEYS.mission_resume, ResumeMission())


@given(moment=st.floats(1.0, 40.0), length=st.floats(0.5, 30.0), seed=st.integers(0, 1000))
@settings(max_examples=4, deadline=None)
def test_a_pause_at_any_time_stops_the_drone_and_costs_nothing_but_time(
    moment: float, length: float, seed: int
) -> None:
    flight = Flight(seed=seed)
    flight.network.run_for(moment)
    was_paused = isinstance(pause(flight), Answered)
    if was_paused:
        assert flight.node.status.phase == "PAUSED"
        flight.network.run_for(2.0)
        place = flight.drone.position
        flight.network.run_for(length)
        assert flight.drone.position == place
        assert isinstance(resume(flight), Answered)
    status = flight.fly()
    assert (status.phase, status.waypoint) == ("SUCCEEDED", status.waypoints)
    assert flight.ends("hover") == ["IT"] * (was_paused and "hover" in flight.started)
    assert flight.idle
    assert flight.on_ground


def test_a_pause_is_reported_and_is_the_cause_of_what_it_stops() -> None:
    flight = Flight()
    flight.network.run_for(17.0)
    pause(flight)
    flight.network.run_for(5.0)
    resume(flight)
    assert flight.fly().phase == "SUCCEEDED"
    assert list(dict.fromkeys(status.phase for status in flight.statuses)) == ["IDLE", "RUNNING", "PAUSED", "SUCCEEDED"]
    texts = [record.text for record in flight.records if "PAUSED" in (record.before, record.after)]
    assert texts == ["somebody walks there", "resumed by the operator"]
    stopped = next(record for record in flight.records if record.subject == "goto_straight" and record.after == "IT")
    assert "PAUSED" in [record.after for record in flight.chain(stopped)]


def test_a_mission_whose_process_dies_while_it_is_paused_leaves_nothing_running() -> None:
    flight = Flight()
    flight.network.run_for(17.0)
    pause(flight)
    flight.network.run_for(3.0)
    assert flight.started[-1] == "hover"
    flight.buses["mission"].close()
    flight.network.run_for(10.0)
    assert flight.ends("hover") == ["IT"]
    assert all(goal.terminal is not None for goal in flight.goals.values())


def test_a_paused_mission_can_be_aborted() -> None:
    flight = Flight()
    flight.network.run_for(17.0)
    pause(flight)
    flight.network.run_for(3.0)
    call_off(flight)
    assert flight.fly().text == "the wind gets up; the robot is on the ground"
    assert flight.on_ground


def test_what_cannot_be_paused_or_resumed_says_so() -> None:
    flight = Flight()
    refused = resume(flight)
    assert isinstance(refused, Refused)
    assert refused.error.message == "The mission is not paused."
    flight.until(lambda: "land" in flight.started)
    refused = pause(flight)
    assert isinstance(refused, Refused)
    assert "cannot be paused" in refused.error.message
    assert flight.fly().phase == "SUCCEEDED"
    without = hop(hold)
    without.network.run_for(10.0)
    refused = pause(without)
    assert isinstance(refused, Refused)
    assert "it can be aborted" in refused.error.message


# --- an end in the air -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("then", "phase"), [(Success("done"), "SUCCEEDED"), (Failure("ill"), "FAILED")])
def test_a_mission_that_ends_in_the_air_after_all_is_landed_by_its_rescue(then: Behaviour, phase: str) -> None:
    flight = Flight(mission=ShortHop(whole=lambda context: Closed(in_order("hidden", take_off(context), then))))
    status = flight.fly()
    assert status.phase == phase
    assert status.text.endswith("; it ended in the air; the robot is on the ground")
    assert flight.started == ["takeoff", "land"]
    assert flight.on_ground
    assert flight.idle


def test_a_mission_that_waits_for_the_robots_report_of_its_place_says_so() -> None:
    flight = Flight(
        mission=ShortHop(whole=lambda context: Closed(in_order("hidden", take_off(context), Success("done"))))
    )
    flight.fly()
    texts = [status.text for status in flight.statuses]
    waiting = texts.index("done; waiting for the robot's report of `flight_status` (in the air so far)")
    assert texts[waiting + 1].startswith("done; it ended in the air; landing")
    waited = flight.statuses[waiting + 1].t - flight.statuses[waiting].t
    assert waited == pytest.approx(mission_run.ARRIVAL_REPORT, abs=0.01), "robot time"


def test_a_mission_that_ends_because_the_pilot_has_the_drone_leaves_it_to_him() -> None:
    def whole(context: MissionContext) -> Behaviour:
        flight = in_order("hop", take_off(context), hold(context))
        return guarded("hop", ResourceIs("may we fly?", context, "SDK_authority", "AVAILABLE"), Closed(flight))

    flight = Flight(mission=ShortHop(whole=whole))
    flight.at(10.0, lambda: flight.drone.set("SDK_authority", "UNAVAILABLE"))
    status = flight.fly()
    assert (status.phase, status.text) == ("FAILED", "SDK_authority is UNAVAILABLE; it has to be AVAILABLE")
    assert "land" not in flight.started
    assert not flight.on_ground


def test_a_mission_that_found_the_drone_in_the_air_may_leave_it_there() -> None:
    mission = FromTheAir(whole=lambda context: SkillAction("wait", context, "hover", {"duration": 1.0}))
    flight = Flight(mission=mission)
    flight.drone.position = (0.0, 0.0, 5.0)
    assert flight.fly().text == "done"
    assert flight.started == ["hover"]


def test_reasons_of_whole_sentences_make_one_sentence() -> None:
    def whole(context: MissionContext) -> Behaviour:
        reasons = [f"{leaf} ended ERROR: Nobody answers. Check that it runs." for leaf in ("goto", "land")]
        tell = [FailureIsSuccess(reason, Failed(context, reason)) for reason in reasons]
        note = NoteSwitch("why", context, "mission", "flight", "landing where it is")
        return Closed(in_order("hidden", take_off(context), tell[0], note, tell[1], Failure("ill")))

    sentence = "ended ERROR: Nobody answers. Check that it runs"
    status = Flight(mission=ShortHop(whole=whole)).fly()
    ended = "it ended in the air; the robot is on the ground"
    assert status.text == f"goto {sentence}; then land {sentence}; {ended}"


# --- errors in the tree ----------------------------------------------------------------------------------------------


def test_a_leaf_that_raises_fails_the_mission_and_the_drone_lands() -> None:
    flight = hop(raising)
    status = flight.fly()
    assert status.phase == "FAILED"
    line = Raising.update.__code__.co_firstlineno + 1
    reason = f"raised ZeroDivisionError: division by zero ({__file__}:{line})"
    assert status.text == f"`raises` {reason}; the robot is on the ground"
    marked = [(node.status, node.feedback) for tree in flight.trees for node in tree.nodes if node.name == "raises"]
    assert ("FAILURE", reason) in marked
    assert flight.ends("land") == ["S_LANDED"]
    assert flight.idle
    assert flight.on_ground


def test_a_progress_that_raises_changes_nothing_of_the_flight(caplog: pytest.LogCaptureFixture) -> None:
    flight = Flight(mission=WithoutProgress())
    status = flight.fly()
    assert (status.phase, status.text) == ("SUCCEEDED", "done")
    assert flight.on_ground
    assert [record.message for record in caplog.records if "progress" in record.message] == [
        "The function `progress` of the mission raised; its latest result is published."
    ]


def test_a_process_that_is_stopped_during_the_rescue_keeps_the_reason_of_the_failure() -> None:
    flight = hop(raising)
    flight.until(lambda: "land" in flight.started)
    flight.node.detach()
    assert flight.node.status.phase == "FAILED"
    assert flight.node.status.text.startswith("the mission's process was stopped; before that: `raises` raised")


def test_a_rescue_that_raises_as_well_still_ends_the_mission() -> None:
    flight = hop(raising, rescue=False)
    status = flight.fly()
    assert status.phase == "FAILED"
    assert "during landing `raises` raised" in status.text
    assert flight.idle


def test_the_end_waits_for_a_skill_that_does_not_confirm_its_stop() -> None:
    flight = hop(hold)
    flight.at(10.0, lambda: flight.drone.freeze("lidar_mapping"))
    flight.at(10.1, lambda: call_off(flight))
    assert flight.fly().phase == "ABORTED"
    assert flight.ends("lidar_mapping") == ["IT"], "forced by the timeout of its manager"
    assert flight.idle
    assert flight.on_ground


def test_the_end_does_not_wait_for_ever_and_names_what_did_not_stop(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mission_run, "SETTLE_TIMEOUT", 1.0)
    flight = hop(lambda context: alongside("hop on", hold(context), until=StatusQueue("fly", HOP, None)))
    flight.at(4.0, lambda: flight.drone.freeze("lidar_mapping"))
    flight.until(lambda: flight.node.over)
    assert flight.node.status.text == "done; these did not stop: lidar_mapping"


def test_a_robot_clock_that_stands_still_ends_the_flight() -> None:
    flight = hop(hold)
    node = MissionNode(ShortHop(hold), M600, MissionOptions(), rescue_goal=ROBOT.rescue_goal)
    flight.network.run_for(10.0)
    flight.node.abort("make room")
    flight.fly()
    node.attach(StillBus(flight.network.bus("still"), at=flight.network.now() + 5.0))
    flight.until(lambda: node.over)
    assert node.status.phase == "FAILED"
    assert node.status.text == "robot time stands still for 15 s"
    flight.network.run_for(5.0)
    assert all(goal.terminal for goal in flight.goals.values())


# --- messages --------------------------------------------------------------------------------------------------------


def test_phases_and_tree_are_published_as_they_change() -> None:
    flight = Flight()
    flight.fly()
    steps = [(record.before, record.after) for record in flight.records if record.kind is RecordKind.MISSION]
    assert steps == [("IDLE", "RUNNING"), ("RUNNING", "SUCCEEDED")]
    assert [status.waypoint for status in flight.statuses] == sorted(status.waypoint for status in flight.statuses)
    assert any(status.goal == (20.0, 10.0, 4.0) for status in flight.statuses)
    assert all(a.nodes != b.nodes for a, b in zip(flight.trees, flight.trees[1:], strict=False))
    running = {node.name for tree in flight.trees for node in tree.nodes if node.status == "RUNNING"}
    assert {"takeoff", "lidar_mapping", "zed_depthmap", "goto_straight", "return_home", "land"} <= running
    assert flight.trees[-1].nodes[0].status == "SUCCESS"


class WithoutRescue(ShortHop):
    def build(self, context: MissionContext, options: Any) -> MissionTrees:
        trees = super().build(context, options)
        return MissionTrees(trees.root, None, trees.progress)


@pytest.mark.parametrize(("mission", "rescue"), [(ShortHop, "landing"), (WithoutRescue, "")])
def test_the_status_names_the_rescue_that_follows_an_abort(mission: type[ShortHop], rescue: str) -> None:
    flight = Flight(mission=mission())
    flight.until(lambda: bool(flight.statuses))
    assert flight.statuses[-1].rescue == rescue


def test_between_changes_nothing_is_published() -> None:
    flight = hop(hold)
    flight.network.run_for(10.0)
    told = len(flight.trees), len(flight.statuses)
    flight.network.run_for(20.0)
    assert (len(flight.trees), len(flight.statuses)) == told


# --- making the node -------------------------------------------------------------------------------------------------


def test_a_node_is_made_from_plain_options() -> None:
    node = make_mission({"mission": "mapping", "skillset": str(M600_FILE), "route": [[10, 0, 4]], "speed": 1.5})
    assert node.mission.name == "mapping"
    assert not node.over


@pytest.mark.parametrize(
    ("options", "error"),
    [
        ({"mission": "mapping"}, InvalidOptionError),
        ({"skillset": str(M600_FILE)}, InvalidOptionError),
        ({"mission": "maping", "skillset": str(M600_FILE)}, UnknownNameError),
        ({"mission": "mapping", "skillset": str(M600_FILE), "sped": 1}, InvalidOptionError),
        ({"mission": "mapping", "skillset": str(M600_FILE), "ready_timeout": "soon"}, InvalidOptionError),
    ],
)
def test_options_that_do_not_fit_raise_a_sentence(options: dict[str, Any], error: type[Exception]) -> None:
    with pytest.raises(error):
        make_mission(options)
