"""Terminal answers: everything that is known of an end, and nothing else."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from skill_desk import ENDED, TOKEN, VIOLATED, Desk, dispatching, failed_to_validate, running, validating

from skillwing.dsl import parse
from skillwing.dsl.model import Skillset
from skillwing.services.core.delivery import SILENCES_UNTIL_ABANDONED, SILENCES_UNTIL_ERROR
from skillwing.services.core.refusal import RefusedError
from skillwing.services.core.skill_actions import AskResources
from skillwing.services.protocol import (
    MAX_MESSAGE_BYTES,
    Ended,
    EndGoal,
    Ending,
    EndKind,
    ErrorCode,
    ErrorReply,
    GoalStatus,
    Granted,
    Lost,
    Record,
    State,
)

LOST = Lost(goal_id="g", skill="move", reason="It was silent.", t=0.0, step=3, record="rm#9", token=TOKEN)


def with_a_note() -> Skillset:
    """A skillset whose skill `move` may tell something of any length."""
    return parse(
        """
        skillset noted {
            skill move {
                output { note: string }
                effect { none {} }
                precondition { success none }
                interrupt { apply=none timeout=1.0 }
                result { DONE: apply=none }
            }
        }
        """
    )


def last_record(desk: Desk) -> Record:
    return desk.records[-1]


def ended_by_itself() -> Desk:
    desk = running()
    desk.terminated()
    return desk


def test_without_an_id_the_running_or_latest_goal_is_reported() -> None:
    desk = Desk()
    with pytest.raises(RefusedError, match="`move` knows of no goal yet") as refusal:
        desk.core.status(None)
    assert (refusal.value.code, refusal.value.help) == (ErrorCode.UNKNOWN_GOAL, "Start one.")
    with pytest.raises(RefusedError, match="`move` knows of no goal x"):
        desk.core.status("x")
    desk.start("early", inputs={"speed": 9.0})
    desk.outcome_committed()
    assert desk.core.status(None).goal_id == "early"
    desk.start()
    assert (desk.core.status(None).goal_id, desk.core.status(None).state) == ("g", State.VALIDATING)
    desk.start("busy")
    assert desk.core.status(None).goal_id == "g"


def test_a_violation_is_reported_with_its_invariant_and_subject() -> None:
    desk = running()
    desk.now = 3.0
    desk.violated()
    terminal = desk.terminal()
    assert (terminal.ending, terminal.invariant, terminal.subject) == (
        Ending.INVARIANT_VIOLATED,
        VIOLATED.invariant,
        VIOLATED.subject,
    )
    assert terminal.reason == VIOLATED.reason
    assert last_record(desk).cause == VIOLATED.record


@pytest.mark.parametrize("way", ["pushed", "renewed", "answered"])
def test_a_loss_is_reported_with_its_observer(way: str) -> None:
    desk = running()
    desk.now = 3.0
    if way == "pushed":
        desk.step(LOST)
    elif way == "renewed":
        desk.renewed(LOST)
    else:
        desk.terminated()
        desk.answer(LOST)
    terminal = desk.terminal()
    assert (terminal.ending, terminal.reason, terminal.detected_by) == (
        Ending.LOST,
        "It was silent.",
        "resource_manager",
    )
    assert last_record(desk).cause == "rm#9"


@pytest.mark.parametrize("code", [ErrorCode.STALE_TOKEN, ErrorCode.UNKNOWN_GOAL])
def test_a_goal_that_is_no_longer_ours_is_lost(code: ErrorCode) -> None:
    desk = running()
    desk.now = 3.0
    desk.renewed(ErrorReply(code=code, message="It is another's."))
    terminal = desk.terminal()
    assert (terminal.ending, terminal.reason, terminal.detected_by) == (
        Ending.LOST,
        "It is another's.",
        "resource_manager",
    )
    assert last_record(desk).cause is None, "its start did not lose it"


def test_a_loss_that_a_renewal_tells_of_comes_after_its_step() -> None:
    """The pushed verdict may be lost, or come later."""
    desk = running()
    desk.renewed(LOST)
    assert (last_record(desk).cause, desk.core.status("g").after_step) == (LOST.record, LOST.step)


@pytest.mark.parametrize("make", [validating, ended_by_itself, failed_to_validate])
def test_silence_and_refusals_are_roots(make: Callable[[], Desk]) -> None:
    for answers in ([None] * SILENCES_UNTIL_ERROR, [ErrorReply(code=ErrorCode.BAD_REQUEST, message="No.")]):
        desk = make()
        for answer in answers:
            desk.answer(answer)
        assert desk.terminal().ending is Ending.ERROR
        assert last_record(desk).cause is None, "its start did not make it fail"


def test_an_end_without_an_answer_is_put_down_to_what_led_to_it() -> None:
    desk = running()
    desk.failed(cause="health#1")
    for _ in range(SILENCES_UNTIL_ERROR):
        desk.answer(None)
    assert last_record(desk).cause == "health#1"
    desk = dispatching()
    desk.failed(cause="health#1")
    desk.dispatched()
    for _ in range(SILENCES_UNTIL_ERROR):
        desk.answer(None)
    assert last_record(desk).cause == "health#1", "and not that `on_dispatch` has returned"
    desk = running()
    desk.interrupt()
    request = desk.records[-1].id
    desk.interrupted()
    for _ in range(SILENCES_UNTIL_ERROR):
        desk.answer(None)
    assert last_record(desk).cause == request


def test_an_exception_in_validate_is_put_down_to_the_request_to_stop_or_to_nothing() -> None:
    desk = failed_to_validate()
    desk.outcome_committed()
    assert last_record(desk).cause is None
    desk = Desk()
    desk.start()
    desk.interrupt()
    request = desk.records[-1]
    desk.raised()
    desk.outcome_committed()
    assert (request.cause, last_record(desk).cause) == ("mission#1", request.id)


def test_a_refusal_is_reported_with_a_remedy() -> None:
    desk = validating()
    desk.answer(ErrorReply(code=ErrorCode.SCHEMA_MISMATCH, message="It is another version.", help="Generate it again."))
    assert desk.terminal().ending is Ending.ERROR
    assert desk.terminal().reason == "The resource manager refused: It is another version. Generate it again."


def test_an_answer_that_does_not_belong_here_ends_in_an_error() -> None:
    desk = running()
    desk.terminated()
    desk.answer(Granted(goal_id="g", token=TOKEN, step=1, record="rm#1"))
    assert desk.terminal().ending is Ending.ERROR
    assert "does not belong here" in desk.terminal().reason


def test_an_unconfirmed_end_is_reported_with_its_reason() -> None:
    desk = running()
    desk.terminated()
    for _ in range(SILENCES_UNTIL_ERROR):
        desk.answer(None)
    assert desk.terminal().reason == "The resource manager does not answer. The skill ended with DONE."


def test_failed_conditions_are_reported_with_the_result() -> None:
    desk = running()
    desk.terminated()
    desk.ended(held=False)
    assert desk.terminal().reason == "The skill ended with DONE. It did not hold."


@pytest.mark.parametrize(
    ("result", "output", "named"),
    [("DOEN", None, "DOEN"), ("DONE", {"distanze": 3.0}, "distanze"), ("DONE", {"distance": "far"}, "distance")],
)
def test_an_end_that_the_skillset_does_not_know_is_an_error_that_names_what_is_wrong(
    result: str, output: dict[str, object] | None, named: str
) -> None:
    desk = running()
    desk.terminated(result, output)
    assert desk.ends_asked == [("error", None, TOKEN)]
    desk.ended()
    assert desk.terminal().ending is Ending.ERROR
    assert named in desk.terminal().reason


@pytest.mark.parametrize(("output", "told"), [(None, None), ({}, {}), ({"distance": 3}, {"distance": 3.0})])
def test_an_output_is_reported_if_there_was_one(
    output: dict[str, object] | None, told: dict[str, object] | None
) -> None:
    desk = running()
    desk.terminated(output=output)
    desk.ended()
    assert desk.terminal().output == told


def test_inputs_that_cannot_be_sent_on_are_not_validated_and_say_so() -> None:
    desk = Desk()
    desk.start(inputs={"label": "\udc80"})
    desk.outcome_committed()
    assert desk.hooks == []
    assert desk.terminal().ending is Ending.NOT_VALIDATED
    assert desk.terminal().reason.startswith("The inputs of `move` cannot be sent to the resource manager: ")


def test_a_begin_that_nobody_hears_of_is_given_up() -> None:
    desk = validating()
    for _ in range(SILENCES_UNTIL_ERROR):
        desk.answer(None)
    assert desk.terminal().reason == "The resource manager does not answer."
    call = desk.asked.call
    assert isinstance(call, EndGoal)
    assert (call.goal_id, call.skill, call.token, call.how) == ("g", "move", 0, "error")
    assert call.cause == last_record(desk).id


def test_giving_back_ends_after_ten_minutes() -> None:
    desk = validating()
    asked = 0
    while asked != len(desk.actions):
        asked = len(desk.actions)
        desk.answer(None)
    assert desk.asked.silences == SILENCES_UNTIL_ABANDONED - 1, "that was the last of so many questions"


@pytest.mark.parametrize("code", list(ErrorCode))
def test_only_what_does_not_say_how_it_was_judged_is_as_good_as_silence(code: ErrorCode) -> None:
    desk = validating()
    desk.answer(ErrorReply(code=code, message="So it is."))
    unjudged = code in (ErrorCode.UNAVAILABLE, ErrorCode.INTERNAL)
    assert (desk.core.current is not None) == unjudged
    asks = [action for action in desk.actions if isinstance(action, AskResources)]
    assert [ask.silences for ask in asks] == ([0, 1] if unjudged else [0])


def test_a_renewal_that_arrives_for_an_earlier_goal_changes_nothing() -> None:
    desk = Desk()
    for answer in (LOST, ENDED, ErrorReply(code=ErrorCode.UNKNOWN_GOAL, message="Never heard of it.")):
        desk.renewed(answer)
    assert desk.actions == []


def test_an_end_by_an_earlier_process_is_reported_as_such() -> None:
    desk = validating()
    desk.answer(Ended(goal_id="g", held=True, reason="", step=2, record="rm#2", how=EndKind.RESULT, result="DONE"))
    terminal = desk.terminal()
    assert (terminal.label, terminal.success) == ("S_DONE", True)
    assert terminal.reason == "An earlier process of this manager ended it."
    assert last_record(desk).cause == "rm#2"


def test_an_interrupt_by_an_earlier_process_was_not_forced() -> None:
    desk = validating()
    desk.answer(Ended(goal_id="g", held=True, reason="It was.", step=2, record="rm#2", how=EndKind.INTERRUPT))
    terminal = desk.terminal()
    assert (terminal.label, terminal.forced) == ("IT", False)
    assert terminal.reason == "An earlier process of this manager ended it. It was."


def test_an_output_that_is_too_long_to_be_sent_is_an_error_that_says_so() -> None:
    desk = Desk(with_a_note())
    desk.start(schema=with_a_note().schema_hash)
    desk.validated()
    desk.granted()
    desk.terminated(output={"note": "x" * MAX_MESSAGE_BYTES})
    assert desk.asked.call.cause is None, "no consequence of the goal's start"
    desk.ended()
    assert desk.terminal().ending is Ending.ERROR
    assert desk.terminal().reason.startswith("The output of DONE cannot be sent: the message has ")


@pytest.mark.parametrize("context", [validating, dispatching, running])
def test_every_status_says_which_record_it_is(context: Any) -> None:
    desk = context()
    records = {record.id: record for record in desk.records}
    for status in desk.actions:
        if isinstance(status, GoalStatus):
            assert records[status.record or ""].after == status.state
