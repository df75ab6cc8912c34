"""Arguments of hooks, requests to the resource manager, and the timeline of a goal."""

from __future__ import annotations

from typing import Any

import msgspec
import pytest
from skill_desk import ENDED, TOKEN, VIOLATED, Desk, interrupting, running, validating

from skillwing.services.core.skill_actions import AskResources, CallHook, Hook
from skillwing.services.core.skill_events import QuestionAnswered
from skillwing.services.protocol import BeginGoal, EndGoal, Ending, EndKind, NotReady, State, Terminal


def test_hooks_get_token_begin_and_end_of_their_goal() -> None:
    desk = Desk()
    desk.now = 3.0
    desk.start()
    desk.now = 4.0
    desk.validated()
    desk.granted()
    desk.dispatched()
    desk.interrupt()
    desk.interrupted()
    desk.ended()
    calls = [action for action in desk.actions if isinstance(action, CallHook)]
    assert [(call.hook, call.goal_id, call.token, call.started_at, call.terminal) for call in calls] == [
        (Hook.VALIDATE, "g", 0, 3.0, None),
        (Hook.DISPATCH, "g", TOKEN, 3.0, None),
        (Hook.INTERRUPT, "g", TOKEN, 3.0, None),
        (Hook.ENDED, "g", TOKEN, 3.0, desk.terminal()),
    ]


def test_each_request_names_the_record_it_comes_of_and_each_record_its_goal() -> None:
    desk = running()
    desk.terminated()
    validating, _, running_ = desk.records
    begin, end = (action.call for action in desk.actions if isinstance(action, AskResources))
    assert isinstance(begin, BeginGoal)
    assert (begin.cause, begin.manager, begin.incarnation) == (validating.id, "skill/move", "this")
    assert isinstance(end, EndGoal)
    assert (end.cause, end.incarnation) == (running_.id, "this")
    desk.ended()
    records = desk.records
    assert [record.goal_id for record in records] == ["g"] * 4
    assert "test" in records[0].text, "who has asked for it"


def test_an_interrupt_is_on_record_with_its_cause_and_who_asked_for_it() -> None:
    desk = interrupting()
    record = desk.records[-1]
    assert (record.after, record.cause, record.text) == ("INTERRUPTING", "mission#1", "test interrupted it.")
    desk = running()
    desk.wait(60.0)
    record = desk.records[-1]
    assert (record.after, record.cause) == ("INTERRUPTING", None), "a deadline that passes is a root"


@pytest.mark.parametrize(
    ("answer", "record"),
    [
        (NotReady(goal_id="g", failing={"free": "It is not."}, step=3, record="rm#1"), "rm#1"),
        (VIOLATED, "rm#9"),
        (ENDED, "rm#2"),
        (msgspec.structs.replace(ENDED, terminal=Terminal(ending=Ending.BUSY, reason="It is.")), "rm#2"),
    ],
)
def test_an_end_by_the_resource_manager_comes_of_its_record(answer: Any, record: str) -> None:
    desk = validating()
    desk.answer(answer)
    last = desk.records[-1]
    assert (last.after, last.cause) == (desk.terminal().label, record)


def test_an_answer_to_no_open_question_ends_nothing() -> None:
    """The answer may be about a forgotten goal with the same id."""
    desk = running()
    old = EndGoal(goal_id="g", skill="move", token=3, how=EndKind.INTERRUPT)
    desk.step(QuestionAnswered(AskResources(old), ENDED))
    assert desk.state is State.RUNNING


def test_the_end_of_a_forgotten_goal_of_that_id_ends_nothing() -> None:
    desk = running()
    desk.terminated()
    old = EndGoal(goal_id="g", skill="move", token=TOKEN - 1, how=EndKind.INTERRUPT)
    desk.step(QuestionAnswered(AskResources(old), ENDED))
    assert desk.terminals == []
    desk.ended()
    assert desk.terminal().label == "S_DONE"
