"""The leaf that runs a skill. Known mistakes of other projects with such leaves are tests by name."""

from __future__ import annotations

import pytest
from fake_interface import FakeMission
from hypothesis import given, settings
from hypothesis import strategies as st
from py_trees.common import Status
from py_trees.composites import Selector

from skillwing.bt_missions.leaves.conditions import ResourceIs
from skillwing.bt_missions.leaves.skill_action import GoalPhase, SkillAction
from skillwing.bt_missions.subtrees.composites import in_order


def tick(leaf: SkillAction) -> Status:
    leaf.tick_once()
    return leaf.status


# --- from start to end -----------------------------------------------------------------------------------------------


def test_a_leaf_sends_its_goal_and_follows_it_to_its_success(mission: FakeMission) -> None:
    leaf = SkillAction("go", mission.context, "go", {"speed": 2.0})
    assert leaf.phase is GoalPhase.IDLE
    assert (tick(leaf), leaf.phase) == (Status.RUNNING, GoalPhase.SENT)
    assert mission.goals[0].inputs == {"speed": 2.0}
    mission.goals[0].run()
    assert (tick(leaf), leaf.phase) == (Status.RUNNING, GoalPhase.RUNNING)
    mission.goals[0].end("S_ARRIVED", success=True)
    assert (tick(leaf), leaf.phase) == (Status.SUCCESS, GoalPhase.DONE)
    assert leaf.feedback_message == "S_ARRIVED"
    assert len(mission.goals) == 1


def test_inputs_given_as_functions_are_asked_at_the_start(mission: FakeMission) -> None:
    speeds = iter([1.0, 3.0])
    leaf = SkillAction("go", mission.context, "go", {"speed": lambda: next(speeds)})
    for wanted in (1.0, 3.0):
        tick(leaf)
        assert mission.goals[-1].inputs == {"speed": wanted}
        mission.goals[-1].end("S_ARRIVED", success=True)
        tick(leaf)


@pytest.mark.parametrize("label", ["S_BLOCKED", "N_ARRIVED", "NV", "NR", "RI", "IT", "BUSY", "ERROR", "LOST"])
def test_whatever_is_no_success_is_a_failure_that_says_why(mission: FakeMission, label: str) -> None:
    leaf = SkillAction("go", mission.context, "go")
    tick(leaf)
    mission.goals[0].end(label)
    assert tick(leaf) is Status.FAILURE
    assert leaf.feedback_message == f"go ended {label}: {label} for the test"
    assert mission.context.failure is not None
    assert mission.context.failure.record == f"goal-0:{label}"


def test_outcomes_are_mapped_by_label(mission: FakeMission) -> None:
    leaf = SkillAction("go", mission.context, "go", outcomes={"S_BLOCKED": Status.SUCCESS, "S_ARRIVED": Status.FAILURE})
    tick(leaf)
    mission.goals[0].end("S_BLOCKED")
    assert tick(leaf) is Status.SUCCESS
    tick(leaf)
    mission.goals[1].end("S_ARRIVED", success=True)
    assert tick(leaf) is Status.FAILURE


def test_on_end_hears_of_ends_but_not_of_halts(mission: FakeMission) -> None:
    heard: list[str] = []
    leaf = SkillAction("go", mission.context, "go", on_end=lambda terminal: heard.append(terminal.label))
    tick(leaf)
    mission.goals[0].end("S_BLOCKED")
    tick(leaf)
    tick(leaf)
    leaf.stop(Status.INVALID)
    mission.goals[1].end("IT")
    assert heard == ["S_BLOCKED"]


def test_an_unknown_skill_fails_the_leaf_with_a_sentence(mission: FakeMission) -> None:
    leaf = SkillAction("fly", mission.context, "fly")
    assert tick(leaf) is Status.FAILURE
    assert "no skill `fly`" in leaf.feedback_message


def test_what_is_started_and_interrupted_names_what_made_it_happen(mission: FakeMission) -> None:
    look, go = SkillAction("look", mission.context, "look"), SkillAction("go", mission.context, "go")
    tick(look)
    tick(go)
    mission.goals[0].end("RI")
    tick(look)
    go.stop(Status.INVALID)
    assert mission.goals[1].interrupt_cause == "goal-0:RI"
    turn = SkillAction("look", mission.context, "look")
    tick(turn)
    assert mission.goals[2].cause == "goal-0:RI"


# --- mistakes others made --------------------------------------------------------------------------------------------


def test_halt_before_the_acknowledgement_does_not_orphan_the_goal(mission: FakeMission) -> None:
    leaf = SkillAction("go", mission.context, "go")
    tick(leaf)
    leaf.stop(Status.INVALID)
    goal = mission.goals[0]
    assert goal.state is None
    assert goal.interrupts == 1
    goal.run()
    assert mission.context.reaper.unfinished == (goal,)
    goal.end("IT")
    assert mission.context.reaper.unfinished == ()
    assert leaf.phase is GoalPhase.DONE


def test_double_halt_interrupts_once_and_raises_nothing(mission: FakeMission) -> None:
    leaf = SkillAction("go", mission.context, "go")
    tick(leaf)
    leaf.stop(Status.INVALID)
    leaf.stop(Status.INVALID)
    leaf.terminate(Status.INVALID)
    assert mission.goals[0].interrupts == 1
    assert leaf.phase is GoalPhase.CANCELLING


def test_halt_of_a_leaf_that_never_ran_does_nothing(mission: FakeMission) -> None:
    leaf = SkillAction("go", mission.context, "go")
    leaf.stop(Status.INVALID)
    assert (mission.goals, leaf.phase) == ([], GoalPhase.IDLE)


def test_cancel_of_a_finished_goal_is_no_error_and_sends_nothing(mission: FakeMission) -> None:
    leaf = SkillAction("go", mission.context, "go")
    tick(leaf)
    mission.goals[0].end("S_ARRIVED", success=True)
    leaf.stop(Status.INVALID)
    assert mission.goals[0].interrupts == 0
    assert mission.context.reaper.unfinished == ()


def test_a_halt_does_not_wait_for_the_robot_to_stop(mission: FakeMission) -> None:
    """BehaviorTree.CPP #1117: a blocking cancel stalls the tree. Here the goal is still running when `stop` has
    returned; the fake would never end it by itself."""
    leaf = SkillAction("go", mission.context, "go")
    tick(leaf)
    mission.goals[0].run()
    leaf.stop(Status.INVALID)
    assert leaf.status is Status.INVALID
    assert not mission.goals[0].done


def test_interrupted_is_never_success(mission: FakeMission) -> None:
    with pytest.raises(ValueError, match="IT to SUCCESS"):
        SkillAction("go", mission.context, "go", outcomes={"IT": Status.SUCCESS})


def test_a_label_cannot_mean_that_the_leaf_goes_on_running(mission: FakeMission) -> None:
    with pytest.raises(ValueError, match="RUNNING"):
        SkillAction("go", mission.context, "go", outcomes={"S_BLOCKED": Status.RUNNING})


def test_a_manager_that_never_answers_leaves_the_tick_free(mission: FakeMission) -> None:
    """No acknowledgement timeout of the leaf: the goal may be executing. The interface ends it as LOST in time."""
    leaf = SkillAction("go", mission.context, "go")
    for mission.time in range(100):
        assert tick(leaf) is Status.RUNNING
    mission.goals[0].end("LOST", detected_by="client")
    assert tick(leaf) is Status.FAILURE


def test_a_refusal_carries_its_reason_into_the_tree(mission: FakeMission) -> None:
    leaf = SkillAction("go", mission.context, "go")
    tick(leaf)
    mission.goals[0].end("NR", failing=("axes_free",))
    tick(leaf)
    assert "NR for the test" in leaf.feedback_message


# --- resources of goals that are being cancelled ---------------------------------------------------------------------


def halted(mission: FakeMission, skill: str) -> SkillAction:
    leaf = SkillAction(skill, mission.context, skill)
    tick(leaf)
    mission.goals[-1].run()
    leaf.stop(Status.INVALID)
    return leaf


def test_a_leaf_waits_for_the_goal_that_holds_what_it_needs(mission: FakeMission) -> None:
    halted(mission, "go")
    turn = SkillAction("turn", mission.context, "turn")
    assert (tick(turn), turn.phase) == (Status.RUNNING, GoalPhase.WAITING)
    assert turn.feedback_message == "waiting until go has stopped"
    assert len(mission.goals) == 1
    mission.goals[0].end("IT")
    assert (tick(turn), turn.phase) == (Status.RUNNING, GoalPhase.SENT)
    assert mission.goals[1].skill == "turn"


def test_a_leaf_that_needs_nothing_of_it_starts_at_once(mission: FakeMission) -> None:
    halted(mission, "go")
    look = SkillAction("look", mission.context, "look")
    tick(look)
    assert look.phase is GoalPhase.SENT


def test_a_leaf_waits_for_its_own_cancelled_goal(mission: FakeMission) -> None:
    leaf = halted(mission, "look")
    assert (tick(leaf), leaf.phase) == (Status.RUNNING, GoalPhase.WAITING)
    mission.goals[0].end("IT")
    tick(leaf)
    assert [goal.goal_id for goal in mission.goals] == ["goal-0", "goal-1"]


def test_patience_ends_in_robot_time(mission: FakeMission) -> None:
    halted(mission, "go")
    turn = SkillAction("turn", mission.context, "turn", patience=5.0)
    tick(turn)
    mission.time = 5.0
    assert tick(turn) is Status.RUNNING
    mission.time = 5.1
    assert tick(turn) is Status.FAILURE
    assert "go did not stop within 5 s" in turn.feedback_message


def test_halting_a_leaf_that_waits_sends_nothing(mission: FakeMission) -> None:
    halted(mission, "go")
    turn = SkillAction("turn", mission.context, "turn")
    tick(turn)
    turn.stop(Status.INVALID)
    assert turn.phase is GoalPhase.IDLE
    assert len(mission.goals) == 1


def test_a_branch_that_preempts_meets_the_old_goal_and_asks_again_with_a_new_id(mission: FakeMission) -> None:
    """py_trees initialises the new branch before it terminates the old one, so the first request is refused."""
    mission.interface.states["camera"] = "FAILED"
    preferred = in_order(
        "preferred",
        ResourceIs("camera?", mission.context, "camera", "OK"),
        turn := SkillAction("turn", mission.context, "turn"),
    )
    go = SkillAction("go", mission.context, "go")
    tree = Selector("select", memory=False, children=[preferred, go])
    tree.tick_once()
    mission.goals[0].run()
    mission.interface.states["camera"] = "OK"
    tree.tick_once()
    assert [goal.skill for goal in mission.goals] == ["go", "turn"]
    assert mission.goals[0].interrupts == 1

    mission.goals[1].end("NR", failing=("axes_free",))
    tree.tick_once()
    assert (tree.status, turn.phase) == (Status.RUNNING, GoalPhase.WAITING)
    mission.goals[0].end("IT")
    tree.tick_once()
    assert [goal.goal_id for goal in mission.goals] == ["goal-0", "goal-1", "goal-2"]
    mission.goals[2].end("S_ALIGNED", success=True)
    tree.tick_once()
    assert tree.status is Status.SUCCESS


@pytest.mark.parametrize("label", ["NR", "BUSY"])
def test_a_refusal_that_overtakes_the_news_of_the_end_is_tried_again_at_once(mission: FakeMission, label: str) -> None:
    turn = SkillAction("turn", mission.context, "turn")
    tick(turn)
    halted(mission, "go")
    mission.goals[0].end(label)
    mission.goals[1].end("IT")
    assert (tick(turn), turn.phase) == (Status.RUNNING, GoalPhase.SENT)
    assert len(mission.goals) == 3


@pytest.mark.parametrize("label", ["NR", "BUSY"])
def test_a_refusal_that_nobody_is_leaving_for_is_final(mission: FakeMission, label: str) -> None:
    earlier = halted(mission, "go")
    mission.goals[0].end("IT")
    assert earlier.phase is GoalPhase.DONE
    turn = SkillAction("turn", mission.context, "turn")
    tick(turn)
    mission.goals[1].end(label)
    assert tick(turn) is Status.FAILURE


def test_while_nobody_has_left_since_a_refusal_nothing_is_asked_again(mission: FakeMission) -> None:
    """`look` holds nothing that `turn` needs by the model, but may still be the reason for the refusal."""
    halted(mission, "look")
    turn = SkillAction("turn", mission.context, "turn")
    tick(turn)
    mission.goals[1].end("NR")
    for _ in range(5):
        assert (tick(turn), turn.phase) == (Status.RUNNING, GoalPhase.WAITING)
    assert len(mission.goals) == 2
    mission.goals[0].end("IT")
    assert (tick(turn), turn.phase) == (Status.RUNNING, GoalPhase.SENT)
    mission.goals[2].end("NR")
    assert tick(turn) is Status.FAILURE


def test_a_lost_goal_is_in_the_way_until_the_resource_manager_has_freed_what_it_held(mission: FakeMission) -> None:
    go = SkillAction("go", mission.context, "go")
    tick(go)
    mission.interface.states["axes"] = "USED"
    mission.goals[0].end("LOST", detected_by="client")
    assert tick(go) is Status.FAILURE
    turn = SkillAction("turn", mission.context, "turn")
    assert (tick(turn), turn.phase) == (Status.RUNNING, GoalPhase.WAITING)
    assert mission.goals[0].interrupts == 0
    mission.interface.states["axes"] = "FREE"
    assert (tick(turn), turn.phase) == (Status.RUNNING, GoalPhase.SENT)


# --- any order of things ---------------------------------------------------------------------------------------------

steps = st.lists(st.sampled_from(["tick", "halt", "run", "arrive", "refuse", "interrupted", "time"]), max_size=40)


@given(steps)
@settings(max_examples=200, deadline=None)
def test_in_any_order_of_things_no_goal_is_left_alone(order: list[str]) -> None:
    """The leaf has one goal at most, and has interrupted any goal that it follows no longer."""
    mission = FakeMission()
    leaf = SkillAction("go", mission.context, "go", patience=3.0)
    for step in order:
        alive = [goal for goal in mission.goals if not goal.done]
        if step == "tick":
            leaf.tick_once()
        elif step == "halt":
            leaf.stop(Status.INVALID)
        elif step == "time":
            mission.time += 1.0
        elif alive:
            if step == "run":
                alive[0].run()
            else:
                label = {"arrive": "S_ARRIVED", "refuse": "NR", "interrupted": "IT"}[step]
                alive[0].end(label, success=step == "arrive")
        alive = [goal for goal in mission.goals if not goal.done]
        assert len(alive) <= 1
        if alive and (leaf.status is not Status.RUNNING or leaf.phase is GoalPhase.WAITING):
            assert alive[0].interrupts == 1
        if leaf.status is Status.SUCCESS:
            assert mission.goals[-1].terminal is not None
            assert mission.goals[-1].terminal.success
