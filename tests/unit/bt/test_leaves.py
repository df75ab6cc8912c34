"""Conditions, loops, deadlines, waypoint writers, and the leaves between two branches."""

from __future__ import annotations

import math

import pytest
from fake_interface import FakeMission
from py_trees.behaviours import Failure, Running, StatusQueue, Success
from py_trees.common import Status

from skillwing.bt_missions.leaves.branch_switch import NoteSwitch, WaitForSettled
from skillwing.bt_missions.leaves.conditions import DataCompare, ResourceIs, Sign
from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.bt_missions.planning.detour import RoutePlanner
from skillwing.bt_missions.planning.waypoints import POSITION_PATIENCE, Route, WaypointWriter
from skillwing.bt_missions.running.tree_snapshot import SnapshotBuilder, render_tree
from skillwing.bt_missions.subtrees.composites import alongside, guarded
from skillwing.bt_missions.subtrees.decorators import Deadline, RepeatUntil
from skillwing.services.protocol import Ending, Terminal, TreeSnapshot

HERE = {"x": 0.0, "y": 0.0, "z": 4.0}


def test_a_resource_condition_follows_the_resource(mission: FakeMission) -> None:
    leaf = ResourceIs("camera?", mission.context, "camera", "OK")
    leaf.tick_once()
    assert leaf.status is Status.SUCCESS
    mission.interface.states["camera"] = "FAILED"
    leaf.tick_once()
    assert leaf.status is Status.FAILURE
    assert leaf.feedback_message == "camera is FAILED"
    assert mission.context.failure is not None
    assert mission.context.failure.record == "camera:changed"


def test_a_question_is_no_incident(mission: FakeMission) -> None:
    leaf = ResourceIs("failed?", mission.context, "camera", "FAILED", question=True)
    leaf.tick_once()
    assert leaf.status is Status.FAILURE
    assert mission.context.failure is None


def test_a_condition_waits_for_its_timeout(mission: FakeMission) -> None:
    leaf = ResourceIs("failed?", mission.context, "camera", "FAILED", wait=2.0)
    for mission.time, status in ((0.0, Status.RUNNING), (1.9, Status.RUNNING), (2.0, Status.FAILURE)):
        leaf.tick_once()
        assert leaf.status is status


@pytest.mark.parametrize(
    ("sign", "value", "holds"), [("<", 21.0, True), (">=", 20.0, True), ("!=", 20.0, False), ("==", 19.0, False)]
)
def test_data_compares_by_its_sign(mission: FakeMission, sign: Sign, value: float, holds: bool) -> None:
    mission.interface.know("battery", 20.0)
    leaf = DataCompare("battery?", mission.context, "battery", sign, value)
    leaf.tick_once()
    assert leaf.status is (Status.SUCCESS if holds else Status.FAILURE)


def test_data_of_a_structure_is_named_by_its_field(mission: FakeMission) -> None:
    mission.interface.know("position", HERE)
    leaf = DataCompare("high?", mission.context, "position.z", ">", 3.0)
    leaf.tick_once()
    assert leaf.status is Status.SUCCESS


def test_stale_and_absent_data_compare_with_nothing(mission: FakeMission) -> None:
    leaf = DataCompare("battery?", mission.context, "battery", ">", 3.0)
    leaf.tick_once()
    assert (leaf.status, leaf.feedback_message) == (Status.FAILURE, "battery is not known")
    mission.interface.know("battery", 20.0, stale=True)
    leaf.tick_once()
    assert (leaf.status, leaf.feedback_message) == (Status.FAILURE, "battery is stale")


def test_a_deadline_halts_what_takes_too_long(mission: FakeMission) -> None:
    action = SkillAction("go", mission.context, "go")
    deadline = Deadline("in time", mission.context, 10.0, action)
    for mission.time, status in ((0.0, Status.RUNNING), (10.0, Status.RUNNING), (10.1, Status.FAILURE)):
        deadline.tick_once()
        assert deadline.status is status
    assert mission.goals[0].interrupts == 1


def test_a_deadline_restarts_with_its_child(mission: FakeMission) -> None:
    deadline = Deadline("in time", mission.context, 10.0, Success("at once"))
    for mission.time in (0.0, 100.0):
        deadline.tick_once()
        assert deadline.status is Status.SUCCESS


def test_a_loop_runs_rounds_until_it_is_done() -> None:
    rounds = [Status.SUCCESS, Status.RUNNING, Status.SUCCESS]
    child = StatusQueue("round", rounds, eventually=Status.FAILURE)
    flown: list[Status] = []
    loop = RepeatUntil("until two rounds are flown", lambda: flown.count(Status.SUCCESS) == 2, child)
    for _ in rounds:
        loop.tick_once()
        assert loop.status is Status.RUNNING
        flown.append(child.status)
    loop.tick_once()
    assert loop.status is Status.SUCCESS
    assert flown == rounds


def test_a_loop_that_is_done_before_it_begins_runs_no_round() -> None:
    loop = RepeatUntil("nothing to do", lambda: True, Failure("never ticked"))
    loop.tick_once()
    assert loop.status is Status.SUCCESS
    assert loop.decorated.status is Status.INVALID


def test_a_round_that_fails_fails_the_loop() -> None:
    loop = RepeatUntil("until done", lambda: False, Failure("round"))
    loop.tick_once()
    assert loop.status is Status.FAILURE


def test_the_deciding_child_ends_a_parallel_and_halts_its_companion(mission: FakeMission) -> None:
    look = SkillAction("look", mission.context, "look")
    flown = StatusQueue("fly", [Status.RUNNING, Status.SUCCESS], eventually=Status.FAILURE)
    tree = alongside("both", look, until=flown)
    tree.tick_once()
    assert tree.status is Status.RUNNING
    tree.tick_once()
    assert tree.status is Status.SUCCESS
    assert mission.goals[0].interrupts == 1


def test_a_companion_that_fails_fails_the_parallel_at_once(mission: FakeMission) -> None:
    look, go = SkillAction("look", mission.context, "look"), SkillAction("go", mission.context, "go")
    tree = alongside("both", look, until=go)
    tree.tick_once()
    mission.goals[0].end("RI")
    tree.tick_once()
    assert tree.status is Status.FAILURE
    assert mission.goals[1].interrupts == 1


def test_a_companion_that_fails_while_the_deciding_child_succeeds_still_fails_the_parallel(
    mission: FakeMission,
) -> None:
    look = SkillAction("look", mission.context, "look")
    tree = alongside("both", look, until=StatusQueue("fly", [Status.RUNNING, Status.SUCCESS], eventually=None))
    tree.tick_once()
    mission.goals[0].end("RI")
    tree.tick_once()
    assert tree.status is Status.FAILURE


def test_a_guard_halts_its_child_in_the_tick_in_which_it_fails(mission: FakeMission) -> None:
    tree = guarded(
        "g", ResourceIs("camera?", mission.context, "camera", "OK"), SkillAction("go", mission.context, "go")
    )
    tree.tick_once()
    mission.interface.states["camera"] = "FAILED"
    tree.tick_once()
    assert tree.status is Status.FAILURE
    assert mission.goals[0].interrupts == 1
    assert mission.goals[0].interrupt_cause == "camera:changed"


def test_a_switch_is_written_down_with_its_cause_and_becomes_the_cause_of_what_follows(mission: FakeMission) -> None:
    look = SkillAction("look", mission.context, "look")
    look.tick_once()
    mission.goals[0].end("RI")
    look.tick_once()
    NoteSwitch("why", mission.context, "navigation", "ZED", "LiDAR").tick_once()
    assert mission.journal == [("navigation", "ZED", "LiDAR", "look ended RI: RI for the test", "goal-0:RI")]
    SkillAction("go", mission.context, "go").tick_once()
    assert mission.goals[1].cause == "mission#1"


def test_settled_waits_for_cancelled_goals_but_not_for_ever(mission: FakeMission) -> None:
    go = SkillAction("go", mission.context, "go")
    go.tick_once()
    go.stop(Status.INVALID)
    settled = WaitForSettled("stopped", mission.context, 10.0)
    settled.tick_once()
    assert settled.status is Status.RUNNING
    mission.time = 10.1
    settled.tick_once()
    assert settled.status is Status.SUCCESS


def test_settled_waits_for_nothing_else(mission: FakeMission) -> None:
    settled = WaitForSettled("stopped", mission.context, 10.0)
    settled.tick_once()
    assert settled.status is Status.SUCCESS


# --- waypoints -------------------------------------------------------------------------------------------------------


def writer_at(mission: FakeMission, *waypoints: tuple[float, float, float]) -> tuple[WaypointWriter, Route]:
    mission.interface.know("position", HERE)
    mission.interface.know("heading", 0.0)
    route = Route(mission.context, RoutePlanner(waypoints))
    return WaypointWriter("WaypointWriter", mission.context, route), route


def ended(result: str, **output: object) -> Terminal:
    success = result == "ARRIVED"
    return Terminal(ending=Ending.SUCCEEDED, reason="", result=result, success=success, output=output or None)


def test_the_writer_writes_leg_after_leg_until_the_route_is_done(mission: FakeMission) -> None:
    writer, route = writer_at(mission, (10, 0, 4), (10, 5, 4))
    for target, crab in (({"x": 10, "y": 0, "z": 4}, -math.pi / 2), ({"x": 10, "y": 5, "z": 4}, 0.0)):
        writer.tick_once()
        assert writer.status is Status.SUCCESS
        assert route.target() == target
        assert route.crab() == pytest.approx(crab)
        mission.interface.know("position", target)
        route.leg_ended(ended("ARRIVED"))
    writer.tick_once()
    assert writer.status is Status.FAILURE
    assert route.is_done()


def test_a_blocked_leg_is_gone_round(mission: FakeMission) -> None:
    writer, route = writer_at(mission, (20, 0, 4))
    writer.tick_once()
    mission.interface.know("position", {"x": 8.0, "y": 0.0, "z": 4.0})
    route.leg_ended(ended("BLOCKED", stopped_at={"x": 8.0, "y": 0.0, "z": 4.0}, obstacle_distance=2.0))
    writer.tick_once()
    assert abs(route.target()["y"]) > 2.0
    assert route.planner.known.discs[0].centre == pytest.approx((10.0, 0.0))


def test_an_interrupted_leg_is_flown_again(mission: FakeMission) -> None:
    writer, route = writer_at(mission, (20, 0, 4))
    writer.tick_once()
    route.leg_ended(Terminal(ending=Ending.INTERRUPTED, reason=""))
    writer.tick_once()
    assert route.target() == {"x": 20, "y": 0, "z": 4}


def test_a_vertical_leg_keeps_the_heading(mission: FakeMission) -> None:
    writer, route = writer_at(mission, (0, 0, 9))
    mission.interface.know("heading", 1.25)
    writer.tick_once()
    assert route.crab() == 1.25


def test_the_writer_waits_for_a_position_but_not_for_ever(mission: FakeMission) -> None:
    writer, _ = writer_at(mission, (20, 0, 4))
    mission.interface.know("position", HERE, stale=True)
    writer.tick_once()
    assert writer.status is Status.RUNNING
    mission.time = POSITION_PATIENCE
    writer.tick_once()
    assert writer.status is Status.FAILURE
    assert "position" in writer.feedback_message


# --- trees as text ---------------------------------------------------------------------------------------------------


def test_a_tree_is_published_depth_first_with_kinds_and_statuses(mission: FakeMission) -> None:
    action = SkillAction("go", mission.context, "go")
    tree = guarded(
        "root", ResourceIs("camera?", mission.context, "camera", "OK"), alongside("p", action, until=Running("r"))
    )
    tree.tick_once()
    portrait = SnapshotBuilder(tree)
    assert portrait.update()
    assert not portrait.update(), "nothing has happened since"
    nodes = portrait.nodes
    assert [(node.name, node.kind, node.parent) for node in nodes] == [
        ("root", "Sequence", None),
        ("camera?", "Condition", 0),
        ("p", "Parallel", 0),
        ("go", "Action", 2),
        ("r", "Behaviour", 2),
    ]
    text = render_tree(TreeSnapshot(mission="m", t=0.0, nodes=nodes)).plain.splitlines()
    assert text[0] == "▶ root"
    assert text[1] == "  ✓ camera?  camera is OK"
    assert text[3] == "    ▶ go  sent"
