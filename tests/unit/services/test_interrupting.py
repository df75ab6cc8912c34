"""Interrupts before, during and after a goal, and goals that come or end too late."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from skill_desk import TOKEN, Desk, interrupting, running, validating

from skillwing.services.core.refusal import RefusedError
from skillwing.services.core.skill_actions import Hook
from skillwing.services.protocol import Ending, ErrorCode, InterruptGoal, State


def started() -> Desk:
    """A goal whose hook `validate` runs."""
    desk = Desk()
    desk.start()
    return desk


def test_mistake_halt_before_the_acknowledgement_orphans_the_goal() -> None:
    desk = Desk()
    with pytest.raises(RefusedError) as refusal:
        desk.interrupt()
    assert refusal.value.code is ErrorCode.UNKNOWN_GOAL
    desk.start()
    desk.outcome_committed()
    assert desk.terminal().ending is Ending.INTERRUPTED
    assert desk.hooks == []


def test_an_interrupt_while_the_grant_is_under_way_gives_it_back_and_dispatches_nothing() -> None:
    desk = validating()
    desk.interrupt()
    assert desk.state is State.INTERRUPTING
    desk.granted()
    assert desk.ends_asked == [("interrupt", None, TOKEN)]
    desk.ended()
    assert desk.hooks == [Hook.VALIDATE]


def test_mistake_resources_are_released_on_the_cancel_acknowledgement() -> None:
    desk = interrupting()
    assert desk.state is State.INTERRUPTING
    assert desk.hooks[-1] is Hook.INTERRUPT
    assert desk.ends_asked == [], "the robot still moves"
    desk.interrupted()
    assert desk.ends_asked == [("interrupt", None, TOKEN)]


def test_mistake_limbo_while_interrupting() -> None:
    desk = interrupting()
    assert desk.core.next_tick() == 2.0
    desk.wait(1.9)
    assert desk.ends_asked == []
    desk.wait(0.1)
    desk.ended()
    assert desk.terminal().forced
    assert "within 2 s" in desk.terminal().reason


def test_mistake_cancel_of_a_finished_goal_throws() -> None:
    desk = running()
    desk.terminated()
    desk.ended()
    for _ in range(2):
        desk.interrupt()
    assert len(desk.terminals) == 1


def test_an_end_that_was_confirmed_was_not_forced() -> None:
    desk = interrupting()
    desk.interrupted()
    desk.ended()
    assert not desk.terminal().forced


def test_mistake_double_halt() -> None:
    desk = interrupting()
    desk.interrupt()
    assert desk.hooks.count(Hook.INTERRUPT) == 1


def test_a_goal_past_its_deadline_is_interrupted() -> None:
    desk = running()
    desk.wait(59.0)
    assert desk.state is State.RUNNING
    desk.wait(1.0)
    assert desk.state is State.INTERRUPTING
    desk.interrupted()
    desk.ended()
    assert desk.terminal().reason == "Its deadline of 60 s passed."
    assert not desk.terminal().success


def test_a_late_start_is_refused_and_never_runs() -> None:
    desk = Desk()
    desk.now = 10.0
    with pytest.raises(RefusedError, match=r"1\.0 s after its deadline") as refusal:
        desk.start(deadline=9.0)
    assert refusal.value.code is ErrorCode.TOO_LATE
    assert desk.actions == []


def test_a_start_at_its_very_deadline_is_in_time() -> None:
    desk = Desk()
    desk.now = 10.0
    desk.start(deadline=10.0)
    assert desk.state is State.VALIDATING


@pytest.mark.parametrize("make", [started, validating, running])
@pytest.mark.parametrize("cause", ["mission#1", None])
def test_an_interrupt_comes_of_its_request_in_every_state(make: Callable[[], Desk], cause: str | None) -> None:
    desk = make()
    desk.step(InterruptGoal(goal_id="g", client="test", cause=cause))
    record = desk.records[-1]
    assert (record.after, record.cause, record.text) == ("INTERRUPTING", cause, "test interrupted it.")
