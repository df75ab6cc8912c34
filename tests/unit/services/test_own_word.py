"""A manager ends no goal by its own word before it knows that nobody else of its name was granted it."""

from __future__ import annotations

from typing import Any

import pytest
from rig import Bench
from skill_desk import REFUSED, TOKEN, VIOLATED, Desk

from skillwing.services.core.grants import NO_TOKEN
from skillwing.services.core.refusal import RefusedError
from skillwing.services.core.skill_actions import AskResources, Hook
from skillwing.services.core.skill_core import DOUBTS_AT_ONCE, SILENCES_UNTIL_ERROR
from skillwing.services.protocol import (
    Ended,
    ErrorCode,
    ErrorReply,
    Granted,
    Lost,
    NotReady,
    RenewGoal,
    State,
)

UNKNOWN = ErrorReply(code=ErrorCode.UNKNOWN_GOAL, message="No goal g was ever granted here.")
LOST = Lost(goal_id="g", skill="move", reason="It was replaced.", t=0.0, record="rm#9", token=TOKEN)


def busy() -> Desk:
    """One that runs another goal, and is asked for a goal `g` that it does not know."""
    desk = Desk()
    desk.start("other")
    desk.take(desk.core.validated("other", None, 0.0))
    desk.answer(Granted(goal_id="other", token=TOKEN, revision=1, record="rm#1"))
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


def failed_to_validate() -> Desk:
    desk = Desk()
    desk.start()
    desk.raised()
    return desk


OWN_WORDS = [
    (busy, "BUSY"),
    (interrupted_early, "IT"),
    (out_of_range, "NV"),
    (not_validated, "NV"),
    (interrupted_while_validating, "IT"),
    (failed_to_validate, "ERROR"),
]


@pytest.mark.parametrize(("make", "label"), OWN_WORDS)
def test_it_asks_before_it_ends_a_goal_by_its_own_word(make: Any, label: str) -> None:
    desk = make()
    assert [goal for goal, _ in desk.terminals] == []
    assert desk.asked.call == RenewGoal(
        goal_id="g", skill="move", token=NO_TOKEN, manager="skill/move", incarnation="this"
    )
    desk.answer(UNKNOWN)
    assert desk.terminal().label == label
    assert Hook.ENDED not in desk.hooks


ANSWERS = [
    (Ended(goal_id="g", held=True, reason="", revision=2, record="rm#2", how="result", result="DONE"), "S_DONE"),
    (Ended(goal_id="g", held=True, reason="", revision=2, record="rm#2", how="interrupt"), "IT"),
    (NotReady(goal_id="g", failing={"free": "It is not."}, record="rm#1"), "NR"),
    (VIOLATED, "RI"),
    (LOST, "LOST"),
    (REFUSED, "LOST"),
    (ErrorReply(code=ErrorCode.BAD_REQUEST, message="The goal g belongs to `turn`."), "ERROR"),
    (Granted(goal_id="g", token=TOKEN, revision=1, record="rm#1"), "ERROR"),
]


@pytest.mark.parametrize(("answer", "label"), ANSWERS)
@pytest.mark.parametrize("make", [make for make, _ in OWN_WORDS])
def test_what_another_one_did_is_the_answer(make: Any, answer: Any, label: str) -> None:
    desk = make()
    desk.answer(answer)
    assert desk.terminal().label == label
    desk.answer(UNKNOWN)
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
    asked = len([action for action in desk.actions if isinstance(action, AskResources)])
    desk.answer(None)
    assert len([action for action in desk.actions if isinstance(action, AskResources)]) == asked


def test_doubts_are_bounded_and_no_goal_is_forgotten_for_that() -> None:
    desk = busy()
    for number in range(1, DOUBTS_AT_ONCE):
        desk.start(f"g{number}")
    with pytest.raises(RefusedError) as refusal:
        desk.start("one too many")
    assert refusal.value.code is ErrorCode.UNAVAILABLE
    desk.start()
    desk.answer(UNKNOWN)
    desk.start("one too many")
    assert desk.core.status("one too many").state is State.VALIDATING


# --- what the resource manager knows ----------------------------------------------------------------------------------


@pytest.fixture
def bench() -> Bench:
    bench = Bench()
    bench.battery(80.0)
    return bench


def ask(bench: Bench, incarnation: str, goal_id: str = "g") -> Any:
    request = RenewGoal(goal_id=goal_id, skill="move", token=NO_TOKEN, manager="skill/move", incarnation=incarnation)
    return bench.perform(bench.core.renew(request))


def begun(bench: Bench) -> int:
    granted = bench.begin("move", "g", incarnation="one")
    assert isinstance(granted, Granted)
    return granted.token


def refused(bench: Bench, incarnation: str) -> ErrorCode:
    with pytest.raises(RefusedError) as refusal:
        ask(bench, incarnation)
    return refusal.value.code


def test_only_the_latest_of_a_name_hears_what_became_of_a_goal(bench: Bench) -> None:
    bench.attach("skill/move", "one")
    bench.begin("move", "g", incarnation="one")
    assert refused(bench, "two") is ErrorCode.UNAVAILABLE
    bench.attach("skill/move", "two")
    assert refused(bench, "one") is ErrorCode.REPLACED
    assert refused(bench, "two") is ErrorCode.STALE_TOKEN, "it was lost when another process attached"


def test_a_successor_hears_how_a_goal_ended_and_that_one_never_was(bench: Bench) -> None:
    bench.attach("skill/move", "one")
    assert refused(bench, "one") is ErrorCode.UNKNOWN_GOAL
    token = begun(bench)
    ended = bench.end("move", "g", token, result="DONE")
    bench.attach("skill/move", "two")
    before = len(bench.published)
    assert ask(bench, "two") == ended
    assert len(bench.published) == before


def test_asking_without_a_token_keeps_no_grant(bench: Bench) -> None:
    bench.attach("skill/move", "one")
    bench.begin("move", "g", incarnation="one")
    assert refused(bench, "one") is ErrorCode.STALE_TOKEN
