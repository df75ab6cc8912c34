"""Promises to a goal's client: ids, repetitions, interrupts at any moment, termination (rules 1, 5, 6 and 9)."""

from __future__ import annotations

from typing import Any

import msgspec
import pytest
from conformance_system import SILENT, System

from skillwing.services.bus import Answer, Refused
from skillwing.services.ids import new_goal_id
from skillwing.services.protocol import Ending, ErrorCode, ErrorReply, GoalStatus, State, encode


def refusal(told: object) -> ErrorCode:
    assert isinstance(told, ErrorReply)
    assert told.message
    return told.code


# --- starting (rule 1) -----------------------------------------------------------------------------------------------


def test_the_same_id_again_tells_how_the_goal_is_and_starts_nothing(system: System) -> None:
    goal = system.run("grip", forever=True)
    before = system.story(goal)
    _, told = system.start("grip", goal)
    assert isinstance(told, GoalStatus)
    assert (told.state, system.story(goal)) == (State.RUNNING, before)


def test_the_same_id_after_the_end_tells_the_end_and_starts_nothing(system: System) -> None:
    goal = system.run("push", result="PUSHED", delay=0.0)
    end = system.end(goal)
    _, told = system.start("push", goal)
    assert isinstance(told, GoalStatus)
    assert told.terminal == end
    system.wait(0.3)
    assert system.story(goal).count(State.RUNNING) == 1


def test_starts_of_the_same_id_at_the_same_time_run_once(system: System) -> None:
    goal = new_goal_id()
    request = encode(system.start_of("grip", goal))
    answers: list[Answer] = []
    for _ in range(5):
        system.bus.ask(system.keys.start("grip"), request, answers.append)
    system.until(lambda: len(answers) == 5, "five answers")
    system.until(lambda: system.state(goal) is State.RUNNING, "the goal to run")
    assert system.story(goal).count(State.DISPATCHING) == 1


def test_a_start_for_another_skillset_is_refused(system: System) -> None:
    assert refusal(system.start("grip", schema="0123456789abcdef")[1]) is ErrorCode.SCHEMA_MISMATCH


def test_a_start_past_its_deadline_is_refused(system: System) -> None:
    goal, told = system.start("grip", deadline=system.bus.now() - 1.0)
    assert refusal(told) is ErrorCode.TOO_LATE
    assert refusal(system.goal("grip", goal)) is ErrorCode.UNKNOWN_GOAL


def test_a_goal_can_be_asked_for_at_any_time(system: System) -> None:
    assert refusal(system.goal("grip", "never-heard-of")) is ErrorCode.UNKNOWN_GOAL
    goal = system.run("grip", forever=True)
    told, current = system.goal("grip", goal), system.goal("grip", None)
    assert isinstance(told, GoalStatus)
    assert told == current
    assert told.state is State.RUNNING


@pytest.mark.parametrize(
    "payload",
    [
        b"",
        b"\xc1\xff",
        msgspec.msgpack.encode({"v": 2, "goal_id": 7}),
        msgspec.msgpack.encode({"v": 99, "goal_id": "x", "inputs": {}, "client": "x", "schema": "x"}),
        msgspec.msgpack.encode({"goal_id": "x", "inputs": {}, "client": "x", "schema": "x", "haste": True}),
        msgspec.msgpack.encode({"goal_id": "x", "inputs": {"force": float("nan")}, "client": "x", "schema": "x"}),
    ],
    ids=["empty", "no MessagePack", "wrong type", "other version", "unknown field", "NaN"],
)
def test_what_is_no_request_is_refused_and_harms_nobody(system: System, payload: bytes) -> None:
    goal = system.run("grip", forever=True)
    answer = system.ask(system.keys.start("grip"), payload)
    assert isinstance(answer, Refused)
    assert answer.error.code is ErrorCode.BAD_REQUEST
    assert system.state(goal) is State.RUNNING


# --- interrupting (rule 5) -------------------------------------------------------------------------------------------


def test_an_interrupt_that_overtakes_its_start_is_not_forgotten(system: System) -> None:
    """Nav2 #6426: a halt before the acknowledgement orphans the goal."""
    goal = new_goal_id()
    assert refusal(system.interrupt("grip", goal)) is ErrorCode.UNKNOWN_GOAL
    system.start("grip", goal)
    assert system.end(goal).ending is Ending.INTERRUPTED
    assert State.DISPATCHING not in system.story(goal)


def test_an_interrupt_right_behind_its_start_ends_the_goal(system: System) -> None:
    goal = new_goal_id()
    answers: list[Answer] = []
    system.bus.ask(system.keys.start("grip"), encode(system.start_of("grip", goal)), answers.append)
    system.interrupt("grip", goal)
    assert system.end(goal).ending is Ending.INTERRUPTED
    assert system.states["arm"] == "FREE"


def test_resources_are_held_until_the_skill_has_really_stopped(system: System) -> None:
    """A turtlebot's `move -> Idle` on the acknowledgement, while the robot still moves."""
    goal = system.run("grip", forever=True, stop_delay=0.3)
    told = system.interrupt("grip", goal)
    assert isinstance(told, GoalStatus)
    assert told.state is State.INTERRUPTING
    assert system.states["arm"] == "TAKEN"
    system.end(goal)
    assert system.states["arm"] == "FREE"


def test_interrupting_twice_is_as_good_as_once(system: System) -> None:
    """BehaviorTree.ROS2 #134: a double halt crashes."""
    goal = system.run("grip", forever=True, stop_delay=0.3)
    told = [system.interrupt("grip", goal), system.interrupt("grip", goal)]
    assert [each.state for each in told if isinstance(each, GoalStatus)] == [State.INTERRUPTING] * 2
    assert system.end(goal).ending is Ending.INTERRUPTED
    assert system.story(goal).count(State.INTERRUPTING) == 1


def test_an_interrupt_after_the_end_gets_that_end(system: System) -> None:
    """BehaviorTree.ROS2 #18: cancelling a finished goal throws."""
    goal = system.run("push", result="PUSHED", delay=0.0)
    end = system.end(goal)
    told = system.interrupt("push", goal)
    assert isinstance(told, GoalStatus)
    assert told.terminal == end


def test_an_interrupt_of_another_goal_leaves_the_running_one_alone(system: System) -> None:
    """Nav2 #6373: cancel-all kills other clients' goals."""
    over = system.run("grip", result="MISSED", delay=0.0, output={"width": 0.0})
    system.end(over)
    goal = system.run("grip", forever=True)
    system.interrupt("grip", over)
    system.interrupt("grip", "never-heard-of")
    system.wait(0.1)
    assert system.state(goal) is State.RUNNING


def test_a_result_while_it_is_interrupted_counts(system: System) -> None:
    """ONERA's generated nodes ignore it, and then wait for ever."""
    goal = system.run("grip", forever=True, stop_delay="never")
    system.interrupt("grip", goal)
    system.stage.end_now("grip", "MISSED")
    end = system.end(goal)
    assert (end.ending, end.result) == (Ending.SUCCEEDED, "MISSED")


def test_a_violation_while_it_is_interrupted_counts(system: System) -> None:
    goal = system.run("grip", forever=True, stop_delay="never")
    system.interrupt("grip", goal)
    system.trigger("door", "AJAR")
    assert system.end(goal).ending is Ending.INVARIANT_VIOLATED


def test_an_interrupt_while_the_grant_is_under_way_lets_nothing_begin(system: System) -> None:
    system.stage.freeze("resource_manager")
    goal, _ = system.start("grip")
    system.interrupt("grip", goal)
    system.stage.thaw("resource_manager")
    assert system.end(goal).ending is Ending.INTERRUPTED
    assert system.story(goal) == [State.VALIDATING, State.INTERRUPTING, State.TERMINATED]
    system.until_states(arm="FREE")


# --- ending (rule 6) -------------------------------------------------------------------------------------------------


def test_what_a_skill_says_after_the_end_changes_nothing(system: System) -> None:
    goal = system.run("grip", result="MISSED", delay=0.3, output={"width": 0.0})
    system.trigger("door", "AJAR")
    assert system.end(goal).ending is Ending.INVARIANT_VIOLATED
    system.trigger("door", "SHUT")
    following = system.run("grip", forever=True)
    system.wait(0.5)
    assert [end.ending for end in system.terminals(goal)] == [Ending.INVARIANT_VIOLATED]
    assert system.state(following) is State.RUNNING


def test_of_two_results_the_first_counts(system: System) -> None:
    system.trigger("part", "PRESENT")
    goal = system.run("grip", forever=True)
    system.stage.freeze("resource_manager")
    system.stage.end_now("grip", "MISSED")
    system.stage.end_now("grip", "GRIPPED")
    system.stage.thaw("resource_manager")
    assert system.end(goal).result == "MISSED"


def test_feedback_comes_while_the_goal_runs_and_not_after(system: System) -> None:
    goal = system.run("grip", forever=True)

    def heard() -> list[dict[str, Any]]:
        return [each.feedback for each in system.feedback if each.goal_id == goal]

    system.until(lambda: len(heard()) >= 2, "two feedbacks")
    assert all(each.keys() == {"reached"} for each in heard())
    system.interrupt("grip", goal)
    system.end(goal)
    system.wait(0.1)
    count = len(heard())
    system.wait(0.3)
    assert len(heard()) == count


# --- silence (rule 9) ------------------------------------------------------------------------------------------------


def test_silence_is_no_refusal_and_asking_again_runs_the_goal_once(system: System) -> None:
    """Nav2 #4278, #4659: the acknowledgement times out, the leaf fails, and the server executes: two drive at once."""
    system.stage.freeze("skill/grip")
    goal, told = system.start("grip", patience=SILENT)
    assert told is None
    system.stage.thaw("skill/grip")
    system.start("grip", goal)
    system.until(lambda: system.state(goal) is State.RUNNING, "the goal to run")
    assert system.story(goal).count(State.DISPATCHING) == 1


def test_a_frozen_manager_does_not_start_minutes_late(system: System) -> None:
    system.stage.freeze("skill/grip")
    goal, told = system.start("grip", deadline=system.bus.now() + 0.1, patience=SILENT)
    assert told is None
    system.stage.thaw("skill/grip")
    assert refusal(system.goal("grip", goal)) is ErrorCode.UNKNOWN_GOAL
    assert system.states["arm"] == "FREE"
