"""Local outcomes: a manager gives none before the resource manager has committed it."""

from __future__ import annotations

from typing import Any

import msgspec
import pytest
from rig import Bench
from skill_desk import REFUSED, TOKEN, VIOLATED, Desk, failed_to_validate

from skillwing.services.core.bounded_dict import GOALS_REMEMBERED
from skillwing.services.core.delivery import PENDING_OUTCOMES_LIMIT, SILENCES_UNTIL_ABANDONED, SILENCES_UNTIL_ERROR
from skillwing.services.core.ends import LONGEST_LOCAL_OUTCOME
from skillwing.services.core.refusal import RefusedError
from skillwing.services.core.skill_actions import AskResources, Hook
from skillwing.services.core.skill_events import QuestionAnswered, Validated
from skillwing.services.core.snapshot import FinishedGoal
from skillwing.services.protocol import (
    NO_TOKEN,
    Ended,
    EndKind,
    ErrorCode,
    ErrorReply,
    Granted,
    Lost,
    NotReady,
    ProtocolError,
    RecordOutcome,
    State,
    Terminal,
    decode,
    encode,
)
from skillwing.services.protocol import Ending as End

LOST = Lost(goal_id="g", skill="move", reason="It was replaced.", t=0.0, step=3, record="rm#9", token=TOKEN)


def busy() -> Desk:
    """One that runs another goal, and is asked for a goal `g` that it does not know."""
    desk = Desk()
    desk.start("other")
    desk.step(Validated("other"))
    desk.answer(Granted(goal_id="other", token=TOKEN, step=1, record="rm#1"))
    desk.start()
    return desk


def interrupted_early() -> Desk:
    desk = Desk()
    with pytest.raises(RefusedError):
        desk.interrupt()
    desk.start()
    return desk


def out_of_range() -> Desk:
    desk = Desk()
    desk.start(inputs={"speed": 99.0})
    return desk


def not_validated() -> Desk:
    desk = Desk()
    desk.start()
    desk.validated("It makes no sense.")
    return desk


def interrupted_while_validating() -> Desk:
    desk = Desk()
    desk.start()
    desk.interrupt()
    desk.validated()
    return desk


OUTCOMES = [
    (busy, "BUSY"),
    (interrupted_early, "IT"),
    (out_of_range, "NV"),
    (not_validated, "NV"),
    (interrupted_while_validating, "IT"),
    (failed_to_validate, "ERROR"),
]


@pytest.mark.parametrize(("make", "label"), OUTCOMES)
def test_it_records_an_outcome_before_it_gives_it(make: Any, label: str) -> None:
    desk = make()
    assert [goal for goal, _ in desk.terminals] == []
    [first, *_] = [record for record in desk.records if record.goal_id == "g"]
    assert (first.after, first.text) == ("VALIDATING", "asked by test")
    asked = desk.asked.call
    assert isinstance(asked, RecordOutcome)
    assert (asked.goal_id, asked.skill) == ("g", "move")
    assert (asked.manager, asked.incarnation) == ("skill/move", "this")
    assert asked.cause == (None if label == "ERROR" else desk.core.status("g").record), "a start makes no hook raise"
    assert asked.terminal.label == label
    desk.outcome_committed()
    assert desk.terminal() == asked.terminal
    assert Hook.ENDED not in desk.hooks


INTERRUPTED = Terminal(ending=End.INTERRUPTED, reason="It was interrupted before it started.")
ANSWERS = [
    (
        Ended(goal_id="g", held=False, reason="", step=2, record="m#2", terminal=INTERRUPTED),
        "IT",
    ),
    (Ended(goal_id="g", held=True, reason="", step=2, record="rm#2", how=EndKind.RESULT, result="DONE"), "S_DONE"),
    (Ended(goal_id="g", held=True, reason="", step=2, record="rm#2", how=EndKind.INTERRUPT), "IT"),
    (NotReady(goal_id="g", failing={"free": "It is not."}, step=3, record="rm#1"), "NR"),
    (VIOLATED, "RI"),
    (LOST, "LOST"),
    (REFUSED, "LOST"),
    (ErrorReply(code=ErrorCode.BAD_REQUEST, message="The goal g belongs to `turn`."), "ERROR"),
    (Granted(goal_id="g", token=TOKEN, step=1, record="rm#1"), "ERROR"),
]


@pytest.mark.parametrize(("answer", "label"), ANSWERS)
@pytest.mark.parametrize("make", [make for make, _ in OUTCOMES])
def test_what_another_one_did_is_the_answer(make: Any, answer: Any, label: str) -> None:
    desk = make()
    late = desk.committed
    desk.answer(answer)
    assert desk.terminal().label == label
    desk.answer(late)
    assert desk.terminal().label == label
    assert "g" not in [run.goal_id for run in [desk.core.current] if run is not None]


def test_a_goal_in_doubt_is_known_and_keeps_nobody_from_running() -> None:
    desk = not_validated()
    assert desk.state is State.VALIDATING
    actions = len(desk.actions)
    desk.start()
    desk.interrupt()
    assert len(desk.actions) == actions
    assert desk.core.current is None
    desk.start("next")
    assert desk.core.current is not None


def test_a_silent_resource_manager_is_asked_again_until_the_goal_gets_its_answer_all_the_same() -> None:
    desk = busy()
    for silences in range(1, SILENCES_UNTIL_ERROR):
        desk.answer(None if silences % 2 else ErrorReply(code=ErrorCode.UNAVAILABLE, message="Not now."))
        assert desk.asked.silences == silences
    assert desk.terminals == []
    desk.answer(None)
    terminal = desk.terminal()
    assert terminal.label == "ERROR"
    assert terminal.reason == "The resource manager does not answer. `move` is busy with goal other."
    call = desk.asked.call
    assert isinstance(call, RecordOutcome)
    assert call.terminal == terminal, "what the client was told is what is to be written down"
    while desk.asked.silences < SILENCES_UNTIL_ABANDONED - 1:
        before = desk.asked.silences
        desk.answer(None)
        assert desk.asked.silences == before + 1
    asked = len([action for action in desk.actions if isinstance(action, AskResources)])
    desk.answer(None)
    assert len([action for action in desk.actions if isinstance(action, AskResources)]) == asked
    assert desk.terminals.count(("g", terminal)) == 1


def test_an_outcome_that_is_committed_late_changes_no_answer() -> None:
    desk = busy()
    for _ in range(SILENCES_UNTIL_ERROR):
        desk.answer(None)
    told = desk.terminal()
    desk.outcome_committed()
    assert desk.terminal() == told
    statuses = [goal for goal, _ in desk.terminals]
    assert statuses == ["g"]
    desk.answer(None)
    assert [goal for goal, _ in desk.terminals] == statuses


def test_doubts_are_bounded_and_no_goal_is_forgotten_for_that() -> None:
    desk = busy()
    first, answer = desk.asked, desk.committed
    for number in range(1, PENDING_OUTCOMES_LIMIT):
        desk.start(f"g{number}")
    with pytest.raises(RefusedError) as refusal:
        desk.start("one too many")
    assert refusal.value.code is ErrorCode.UNAVAILABLE
    desk.step(QuestionAnswered(first, answer))
    desk.start("one too many")
    assert desk.core.status("one too many").state is State.VALIDATING


# --- what the resource manager knows ----------------------------------------------------------------------------------


def ask(bench: Bench, incarnation: str, goal_id: str = "g", terminal: Terminal = INTERRUPTED) -> Any:
    request = RecordOutcome(
        goal_id=goal_id,
        skill="move",
        terminal=terminal,
        manager="skill/move",
        incarnation=incarnation,
        cause="m#1",
    )
    return bench.perform(bench.core.step(request, bench.now))


def begun(bench: Bench) -> int:
    granted = bench.begin("move", "g", incarnation="one")
    assert isinstance(granted, Granted)
    return granted.token


def refused(bench: Bench, incarnation: str) -> ErrorCode:
    with pytest.raises(RefusedError) as refusal:
        ask(bench, incarnation)
    return refusal.value.code


def test_only_the_latest_of_a_name_records_outcomes(bench: Bench) -> None:
    bench.attach("skill/move", "one")
    bench.begin("move", "g", incarnation="one")
    assert refused(bench, "two") is ErrorCode.UNAVAILABLE
    bench.attach("skill/move", "two")
    assert refused(bench, "one") is ErrorCode.REPLACED
    assert [ask(bench, "two")] == bench.of(Lost), "it was lost when another process attached"


def test_a_successor_hears_how_a_goal_has_ended(bench: Bench) -> None:
    bench.attach("skill/move", "one")
    token = begun(bench)
    ended = bench.end("move", "g", token, result="DONE")
    bench.attach("skill/move", "two")
    before = len(bench.published)
    assert ask(bench, "two") == ended
    assert len(bench.published) == before


def test_a_goal_with_a_local_outcome_begins_nowhere(bench: Bench) -> None:
    bench.attach("skill/move", "one")
    ended = ask(bench, "one")
    assert (ended.terminal, ended.reason, ended.record, ended.held) == (INTERRUPTED, "", "m#1", False)
    assert ended.how is None
    assert bench.kept[-1:] == [FinishedGoal("g", "move", NO_TOKEN, ended)]
    bench.attach("skill/move", "two")
    states = dict(bench.core.states)
    assert bench.begin("move", "g", incarnation="two") == ended
    assert ask(bench, "two", terminal=Terminal(ending=End.BUSY, reason="It runs another.")) == ended
    assert bench.core.states == states
    assert not bench.core.grants


def test_a_goal_that_somebody_holds_is_left_alone(bench: Bench) -> None:
    bench.attach("skill/move", "one")
    bench.begin("move", "g", incarnation="one")
    assert refused(bench, "one") is ErrorCode.STALE_TOKEN
    assert [grant.goal_id for grant in bench.core.grants] == ["g"]


def test_an_outcome_that_is_too_long_is_not_stored(bench: Bench) -> None:
    bench.attach("skill/move", "one")
    with pytest.raises(RefusedError) as refusal:
        ask(bench, "one", terminal=Terminal(ending=End.ERROR, reason="a" * LONGEST_LOCAL_OUTCOME))
    assert refusal.value.code is ErrorCode.BAD_REQUEST
    assert isinstance(ask(bench, "one"), Ended)


def test_the_outcome_of_a_start_with_a_huge_name_is_short() -> None:
    desk = Desk()
    desk.start(inputs={"a" * 1_000_000: 1.0})
    assert len(encode(desk.committed)) < 5000


@pytest.mark.parametrize(
    "terminal",
    [
        Terminal(ending=End.SUCCEEDED, reason="It says so.", result="DONE", success=True),
        Terminal(ending=End.BUSY, reason="It is.", result="DONE"),
        Terminal(ending=End.ERROR, reason="A success all the same.", success=True),
        Terminal(ending=End.ERROR, reason="It brings something.", output={}),
        Terminal(ending=End.INTERRUPTED, reason="It was stopped.", forced=True),
        Terminal(ending=End.NOT_READY, reason="That is not its to judge."),
        Terminal(ending=End.LOST, reason="Nor that."),
    ],
)
def test_what_cannot_be_a_local_outcome_is_refused(bench: Bench, terminal: Terminal) -> None:
    bench.attach("skill/move", "one")
    with pytest.raises(RefusedError) as refusal:
        ask(bench, "one", terminal=terminal)
    assert refusal.value.code is ErrorCode.BAD_REQUEST
    assert refusal.value.known == ("BUSY", "NV", "IT", "ERROR")
    assert refusal.value.help


@pytest.mark.parametrize("change", [{"token": 1}, {"terminal": None}, {"manager": None}, {"incarnation": None}])
def test_an_outcome_has_no_token_and_always_a_terminal_and_a_sender(change: dict[str, Any]) -> None:
    request = RecordOutcome(goal_id="g", skill="move", terminal=INTERRUPTED, manager="skill/move", incarnation="one")
    fields = msgspec.msgpack.decode(encode(request))
    assert decode(msgspec.msgpack.encode(fields), RecordOutcome) == request
    with pytest.raises(ProtocolError):
        decode(msgspec.msgpack.encode(fields | change), RecordOutcome)


def test_refusals_push_out_no_interrupted_goal(bench: Bench) -> None:
    bench.attach("skill/move", "one")
    ended = ask(bench, "one")
    for number in range(GOALS_REMEMBERED + 1):
        ask(bench, "one", f"busy{number}", Terminal(ending=End.BUSY, reason="It runs another."))
    assert ask(bench, "one") == ended
    assert bench.kept[-1].goal_id != "g"  # pyright: ignore[reportAttributeAccessIssue] - a FinishedGoal
