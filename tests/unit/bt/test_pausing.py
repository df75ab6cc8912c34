"""Leaves that are held, the nodes that hold them, and `OnEnding`."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from fake_interface import FakeMission
from hypothesis import given, settings
from hypothesis import strategies as st
from py_trees.behaviour import Behaviour
from py_trees.behaviours import Failure, Running, StatusQueue, Success
from py_trees.common import Status
from py_trees.decorators import Inverter

from skillwing.bt_missions.checking.mission_check import offline_context
from skillwing.bt_missions.leaves.branch_switch import NeverSwitched
from skillwing.bt_missions.leaves.conditions import ResourceIs
from skillwing.bt_missions.leaves.context import MissionContext
from skillwing.bt_missions.leaves.pause_gate import HELD
from skillwing.bt_missions.leaves.skill_action import GoalPhase, SkillAction
from skillwing.bt_missions.mission.mission import MissionTrees
from skillwing.bt_missions.missions import inspection, mapping
from skillwing.bt_missions.planning.waypoints import POSITION_PATIENCE, PointAbove
from skillwing.bt_missions.subtrees.composites import OnEnding, alongside, in_order
from skillwing.bt_missions.subtrees.pausing import Pausable, StateChange, WhileGranted
from skillwing.dsl.queries import taken_by
from skillwing.services.protocol import Terminal
from skillwing.services.robot import find_robot


class Gate:
    """A gate that the test closes and opens."""

    def __init__(self) -> None:
        self.closed = False

    def blocks(self, skill: str) -> str | None:
        return "for a test" if self.closed else None

    def explains(self, skill: str, terminal: Terminal) -> bool:
        return terminal.subject == "camera"


def held_leaf(mission: FakeMission, gate: Gate, **more: object) -> SkillAction:
    leaf = SkillAction("go", mission.context, "go", **more)  # pyright: ignore[reportArgumentType]
    leaf.follow(gate)
    return leaf


def tick(node: Behaviour) -> Status:
    node.tick_once()
    return node.status


# --- the leaf --------------------------------------------------------------------------------------------------------


def test_a_held_leaf_interrupts_its_goal_once_and_starts_another_later(mission: FakeMission) -> None:
    gate = Gate()
    leaf = held_leaf(mission, gate)
    tick(leaf)
    gate.closed = True
    for _ in range(3):
        assert (tick(leaf), leaf.phase) == (Status.RUNNING, GoalPhase.HELD)
    assert (leaf.feedback_message, mission.goals[0].interrupts) == ("held: for a test", 1)
    mission.goals[0].end("IT")
    mission.time += 100.0
    tick(leaf)
    assert len(mission.goals) == 1
    gate.closed = False
    assert (tick(leaf), leaf.phase) == (Status.RUNNING, GoalPhase.SENT)
    assert len(mission.goals) == 2


def test_a_leaf_that_is_held_from_the_start_asks_for_nothing(mission: FakeMission) -> None:
    gate = Gate()
    gate.closed = True
    leaf = held_leaf(mission, gate)
    assert (tick(leaf), leaf.phase, mission.goals) == (Status.RUNNING, GoalPhase.HELD, [])
    leaf.stop(Status.INVALID)
    assert leaf.phase is GoalPhase.IDLE


def test_the_next_goal_waits_until_the_held_one_has_stopped(mission: FakeMission) -> None:
    gate = Gate()
    leaf = held_leaf(mission, gate)
    tick(leaf)
    mission.goals[0].run()
    gate.closed = True
    tick(leaf)
    gate.closed = False
    assert (tick(leaf), leaf.phase) == (Status.RUNNING, GoalPhase.WAITING)
    mission.goals[0].end("IT")
    assert (tick(leaf), leaf.phase) == (Status.RUNNING, GoalPhase.SENT)


def test_a_goal_that_ends_by_itself_while_it_is_held_counts(mission: FakeMission) -> None:
    gate = Gate()
    leaf = held_leaf(mission, gate)
    tick(leaf)
    gate.closed = True
    tick(leaf)
    mission.goals[0].end("S_ARRIVED", success=True)
    assert tick(leaf) is Status.SUCCESS


def test_a_goal_that_ends_by_itself_after_the_hold_counts_and_does_not_begin_again(mission: FakeMission) -> None:
    """Braking takes seconds: a pause may be over before the goal has stopped, and the goal may arrive meanwhile."""
    gate = Gate()
    leaf = held_leaf(mission, gate)
    tick(leaf)
    for closed in (True, False, True, False):
        gate.closed = closed
        assert tick(leaf) is Status.RUNNING
    mission.goals[0].end("S_ARRIVED", success=True)
    assert (tick(leaf), leaf.ending, len(mission.goals)) == (Status.SUCCESS, "S_ARRIVED", 1)


@pytest.mark.parametrize("label", ["RI", "NR"])
def test_a_goal_that_ends_for_the_sake_of_the_gate_is_held_and_no_failure(mission: FakeMission, label: str) -> None:
    """The gate may be open again by now: then the goal begins again at the next tick."""
    leaf = held_leaf(mission, Gate())
    tick(leaf)
    mission.goals[0].end(label, subject="camera")
    assert (tick(leaf), leaf.phase) == (Status.RUNNING, GoalPhase.HELD)
    tick(leaf)
    assert len(mission.goals) == 2


@pytest.mark.parametrize("status", [Status.SUCCESS, Status.FAILURE])
def test_a_leaf_may_say_what_being_held_means(mission: FakeMission, status: Status) -> None:
    gate, heard = Gate(), list[str]()
    leaf = held_leaf(mission, gate, outcomes={HELD: status}, on_end=lambda terminal: heard.append(terminal.label))
    tick(leaf)
    gate.closed = True
    tick(leaf)
    mission.goals[0].end("IT")
    gate.closed = False
    assert (tick(leaf), leaf.ending, heard) == (status, HELD, ["IT"])


def test_a_held_leaf_that_is_halted_leaves_its_goal_to_the_reaper(mission: FakeMission) -> None:
    gate = Gate()
    leaf = held_leaf(mission, gate)
    tick(leaf)
    gate.closed = True
    tick(leaf)
    leaf.stop(Status.INVALID)
    assert (leaf.phase, mission.goals[0].interrupts) == (GoalPhase.CANCELLING, 1)
    mission.goals[0].end("IT")
    assert leaf.phase is GoalPhase.DONE


@given(st.lists(st.sampled_from(["tick", "halt", "close", "open", "run", "arrive", "stop"]), max_size=40))
@settings(max_examples=100, deadline=None)
def test_in_any_order_of_things_a_held_leaf_has_one_goal_at_most(order: list[str]) -> None:
    mission, gate = FakeMission(), Gate()
    leaf = held_leaf(mission, gate)
    for step in order:
        alive = [goal for goal in mission.goals if not goal.done]
        match step:
            case "tick":
                leaf.tick_once()
            case "halt":
                leaf.stop(Status.INVALID)
            case "close" | "open":
                gate.closed = step == "close"
            case "run" if alive:
                alive[0].run()
            case "arrive" if alive:
                alive[0].end("S_ARRIVED", success=True)
            case "stop" if alive and alive[0].interrupts:
                alive[0].end("IT")
            case _:
                pass
        alive = [goal for goal in mission.goals if not goal.done]
        assert len(alive) <= 1
        if step == "tick" and gate.closed:
            assert all(goal.interrupts == 1 for goal in alive)
        assert leaf.status is not Status.FAILURE


def test_a_held_goal_counts_what_it_has_done_until_its_end(mission: FakeMission) -> None:
    gate = Gate()
    leaf = held_leaf(mission, gate, inputs={"speed": 4.0}, done={"speed": "reached"})
    tick(leaf)
    gate.closed = True
    tick(leaf)
    mission.goals[0].progress = {"reached": 1.0}
    gate.closed = False
    tick(leaf)
    mission.goals[0].progress = {"reached": 2.5}
    mission.goals[0].end("IT")
    tick(leaf)
    assert mission.goals[1].inputs == {"speed": 1.5}


# --- what holds ------------------------------------------------------------------------------------------------------


def granted(mission: FakeMission, child: Behaviour) -> WhileGranted:
    return WhileGranted(
        "granted",
        mission.context,
        child,
        resource="axes",
        states=("FREE",),
        patience=10.0,
        ended_by=StateChange("camera", "FAILED"),
    )


def test_only_what_needs_the_grant_is_held(mission: FakeMission) -> None:
    go, look = SkillAction("go", mission.context, "go"), SkillAction("look", mission.context, "look")
    tree = granted(mission, in_order("both", look, go))
    tick(tree)
    mission.interface.states["axes"] = "USED"
    tick(tree)
    assert mission.goals[0].interrupts == 0, "looking needs no axes"
    mission.goals[0].end("S_NO_DATA")
    assert tick(tree) is Status.FAILURE, "what goes on may fail"


@pytest.mark.parametrize(("wait", "ended"), [(10.1, False), (1.0, True)])
def test_a_grant_that_stays_away_or_is_ended_fails_with_the_reason(
    mission: FakeMission, wait: float, ended: bool
) -> None:
    tree = granted(mission, SkillAction("go", mission.context, "go"))
    tick(tree)
    mission.interface.states["axes"] = "USED"
    assert tick(tree) is Status.RUNNING
    mission.time += wait
    mission.interface.states["camera"] = "FAILED" if ended else "OK"
    assert tick(tree) is Status.FAILURE
    assert tree.feedback_message.startswith("axes is USED")
    assert mission.goals[0].interrupts == 1
    assert mission.context.failure is not None
    assert mission.context.failure.record == "axes:changed"


def test_an_end_that_was_there_before_is_none(mission: FakeMission) -> None:
    tree = granted(mission, Running("on and on"))
    mission.interface.states |= {"axes": "USED", "camera": "FAILED"}
    assert tick(tree) is Status.RUNNING


def pausable(mission: FakeMission, meanwhile: Behaviour, body: Behaviour) -> Pausable:
    return Pausable("pausable", mission.context, ResourceIs("ok?", mission.context, "camera", "OK"), meanwhile, body)


@pytest.mark.parametrize("end", [Status.SUCCESS, Status.FAILURE])
def test_it_ends_as_its_body_does_even_while_it_is_paused(mission: FakeMission, end: Status) -> None:
    turn = SkillAction("turn", mission.context, "turn")
    tree = pausable(mission, turn, StatusQueue("body", [Status.RUNNING, Status.RUNNING, end], eventually=None))
    tick(tree)
    assert tree.pause("for a test") is None
    assert tree.pause("again") is None
    assert (tick(tree), tree.reason) == (Status.RUNNING, "for a test")
    assert tick(tree) is end
    assert mission.goals[0].interrupts == 1
    assert tree.reason is None


def test_what_does_not_run_is_not_paused(mission: FakeMission) -> None:
    tree = pausable(mission, Running("meanwhile"), Running("body"))
    assert tree.pause("too early") is not None
    tick(tree)
    mission.interface.states["camera"] = "FAILED"
    assert tree.pause("against its condition") == "camera is FAILED"
    assert tree.reason is None


@pytest.mark.parametrize(
    ("condition", "reason"),
    [
        (lambda context: Failure("may it wait?"), "its condition `may it wait?` does not hold"),
        (lambda context: Inverter("may it wait?", Success("no")), "its condition `may it wait?` does not hold"),
        (
            lambda context: StatusQueue("may it wait?", [Status.FAILURE], None),
            "its condition `may it wait?` does not hold",
        ),
        (lambda context: in_order("all", ResourceIs("ok?", context, "camera", "FAILED")), "camera is OK"),
        (lambda context: Inverter("not", ResourceIs("ok?", context, "camera", "OK")), "camera is OK"),
    ],
)
def test_a_refused_pause_has_a_reason(
    mission: FakeMission, condition: Callable[[MissionContext], Behaviour], reason: str
) -> None:
    tree = Pausable("pausable", mission.context, condition(mission.context), Running("meanwhile"), Running("body"))
    tick(tree)
    assert tree.pause("for a test") == reason


@pytest.mark.parametrize("meanwhile", [None, "look"])
def test_a_pause_whose_second_child_takes_nothing_holds_all_skills(mission: FakeMission, meanwhile: str | None) -> None:
    instead = Success("nothing") if meanwhile is None else SkillAction("watch", mission.context, meanwhile)
    go = SkillAction("go", mission.context, "go")
    tree = pausable(mission, instead, go)
    tick(tree)
    mission.goals[0].run()
    assert tree.pause("for a test") is None
    assert (tick(tree), go.phase, mission.goals[0].interrupts) == (Status.RUNNING, GoalPhase.HELD, 1)
    mission.goals[0].end("IT")
    assert (tick(tree), tree.reason) == (Status.RUNNING, "for a test")
    tree.resume()
    assert (tick(tree), go.phase) == (Status.RUNNING, GoalPhase.SENT)


def test_a_pause_holds_a_skill_that_runs_alone_whatever_it_takes(mission: FakeMission) -> None:
    turn, look = SkillAction("turn", mission.context, "turn"), SkillAction("look", mission.context, "look")
    tree = pausable(mission, turn, in_order("body", look, SkillAction("go", mission.context, "go")))
    tick(tree)
    tree.pause("for a test")
    assert (tick(tree), look.phase, mission.goals[0].interrupts) == (Status.RUNNING, GoalPhase.HELD, 1)


def test_what_runs_beside_a_held_skill_goes_on(mission: FakeMission) -> None:
    look, go = SkillAction("look", mission.context, "look"), SkillAction("go", mission.context, "go")
    turn = SkillAction("turn", mission.context, "turn")
    tree = pausable(mission, turn, alongside("both", look, until=in_order("way", Success("ready"), go)))
    tick(tree)
    for goal in mission.goals:
        goal.run()
    tree.pause("for a test")
    assert (tick(tree), look.phase, go.phase) == (Status.RUNNING, GoalPhase.RUNNING, GoalPhase.HELD)


@pytest.mark.parametrize(
    "trees",
    [
        lambda context: mapping.MISSION.build(context, mapping.MappingMissionOptions()),
        lambda context: inspection.MISSION.build(context, inspection.InspectionOptions()),
    ],
    ids=["mapping", "inspection"],
)
def test_a_pause_of_the_m600_holds_what_takes_the_resources_of_hover(
    trees: Callable[[MissionContext], MissionTrees],
) -> None:
    skillset = find_robot("m600").load_skillset()
    root = trees(offline_context(skillset)).root
    (flight,) = (node for node in root.iterate() if isinstance(node, Pausable))
    leaves = [node for node in flight.children[-1].iterate() if isinstance(node, SkillAction)]
    moving = [
        leaf.name for leaf in leaves if taken_by(skillset.skill("hover")).keys() & taken_by(skillset.skill(leaf.skill))
    ]
    assert [leaf.name for leaf in flight.held] == moving
    assert len(moving) < len(leaves)


# --- on an ending ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("label", "goes_over"), [("NR", True), ("S_BLOCKED", True), ("LOST", False)])
def test_the_other_branch_takes_over_on_these_endings_alone(mission: FakeMission, label: str, goes_over: bool) -> None:
    tree = OnEnding("try", SkillAction("go", mission.context, "go"), ("NR", "S_BLOCKED"), Success("instead"))
    tick(tree)
    mission.goals[0].end(label)
    assert tick(tree) is (Status.SUCCESS if goes_over else Status.FAILURE)


def test_the_other_branch_is_no_way_back(mission: FakeMission) -> None:
    instead = StatusQueue("instead", [Status.RUNNING, Status.FAILURE], eventually=None)
    tree = OnEnding("try", SkillAction("go", mission.context, "go"), ("NR",), instead)
    tick(tree)
    mission.goals[0].end("NR")
    assert [tick(tree), tick(tree)] == [Status.RUNNING, Status.FAILURE]
    assert len(mission.goals) == 1
    tick(tree)
    assert len(mission.goals) == 2, "only a new round tries again"


def test_what_fails_without_a_skill_is_no_ending(mission: FakeMission) -> None:
    attempt = in_order("attempt", Failure("no"), SkillAction("go", mission.context, "go"))
    assert tick(OnEnding("try", attempt, ("NR",), Success("instead"))) is Status.FAILURE


# --- the others ------------------------------------------------------------------------------------------------------


def test_a_switch_is_not_forgotten(mission: FakeMission) -> None:
    leaf = NeverSwitched("as planned?", mission.context, "flight")
    mission.context.note_switch("something else", "a", "b")
    assert tick(leaf) is Status.SUCCESS
    mission.context.observe("the wind gets up", None, failed=True)
    mission.context.note_switch("flight", "mapping", "coming home")
    assert tick(leaf) is Status.FAILURE
    assert leaf.feedback_message == "mapping -> coming home, for the wind gets up"


@pytest.mark.parametrize(("z", "wanted"), [(1.0, 4.0), (9.0, 9.0)])
def test_the_point_above_is_never_below(mission: FakeMission, z: float, wanted: float) -> None:
    leaf = PointAbove("up", mission.context, 4.0)
    with pytest.raises(LookupError):
        leaf.target()
    assert tick(leaf) is Status.RUNNING
    mission.interface.know("position", {"x": 1.0, "y": 2.0, "z": z})
    assert tick(leaf) is Status.SUCCESS
    assert leaf.target() == {"x": 1.0, "y": 2.0, "z": wanted}


def test_a_position_that_stays_unknown_is_given_up(mission: FakeMission) -> None:
    leaf = PointAbove("up", mission.context, 4.0)
    tick(leaf)
    mission.time += POSITION_PATIENCE
    assert tick(leaf) is Status.FAILURE


def test_a_condition_that_raises_refuses_the_pause_and_ends_nothing(mission: FakeMission) -> None:
    """A condition may be a leaf of the user's own, and an operator's pause must not end a mission in flight."""

    class Raising(Behaviour):
        def update(self) -> Status:
            raise ZeroDivisionError("division by zero")

    pausable = Pausable("pausable", mission.context, Raising("raises"), Running("hover"), Running("fly"))
    tick(pausable)
    assert pausable.pause("for a look") == "its condition raised ZeroDivisionError: division by zero"
    assert (tick(pausable), pausable.reason) == (Status.RUNNING, None)
