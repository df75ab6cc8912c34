"""Figure 5, transition by transition."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest
from skill_desk import ENDED, REFUSED, TOKEN, VIOLATED, Desk, dispatching, interrupting, owned, running, validating

from skillwing.services.core.bounded_dict import GOALS_REMEMBERED
from skillwing.services.core.refusal import RefusedError
from skillwing.services.core.skill_actions import CallHook, Hook
from skillwing.services.core.skill_events import Terminated
from skillwing.services.protocol import (
    MAX_MESSAGE_BYTES,
    BeginGoal,
    Ended,
    Ending,
    EndKind,
    ErrorCode,
    ErrorReply,
    Lost,
    NotReady,
    State,
    encode,
)


def then(*steps: Callable[[Desk], None]) -> Callable[[Desk], None]:
    def play(desk: Desk) -> None:
        for step in steps:
            step(desk)

    return play


ENDINGS: list[tuple[Callable[[], Desk], Callable[[Desk], None], str]] = [
    (Desk, then(lambda d: d.start(inputs={"speed": 9.0}), Desk.outcome_committed), "NV"),
    (Desk, then(Desk.start, lambda d: d.validated("Too windy."), Desk.outcome_committed), "NV"),
    (Desk, then(Desk.start, Desk.raised, Desk.outcome_committed), "ERROR"),
    (
        validating,
        lambda d: d.answer(NotReady(goal_id="g", failing={"free": "It is not."}, step=3, record="rm#1")),
        "NR",
    ),
    (validating, lambda d: d.answer(VIOLATED), "RI"),
    (validating, then(Desk.violated, Desk.granted, Desk.ended), "RI"),
    (validating, then(Desk.interrupt, Desk.granted, Desk.ended), "IT"),
    (validating, then(Desk.interrupt, lambda d: d.answer(ended_by_predecessor())), "S_DONE"),
    (validating, then(Desk.interrupt, Desk.violated), "RI"),
    (Desk, then(Desk.start, Desk.violated), "RI"),
    (Desk, then(Desk.start, lambda d: d.step(lost())), "LOST"),
    (Desk, then(Desk.start, Desk.interrupt, Desk.violated), "RI"),
    (Desk, then(Desk.start, Desk.interrupt, Desk.validated, Desk.outcome_committed), "IT"),
    (Desk, then(Desk.start, Desk.interrupt, lambda d: d.validated("Too windy."), Desk.outcome_committed), "NV"),
    (Desk, then(Desk.start, Desk.interrupt, Desk.raised, Desk.outcome_committed), "ERROR"),
    (validating, lambda d: d.answer(REFUSED), "LOST"),
    (validating, lambda d: d.answer(ErrorReply(code=ErrorCode.SCHEMA_MISMATCH, message="No.")), "ERROR"),
    (dispatching, then(Desk.terminated, Desk.dispatched, Desk.ended), "S_DONE"),
    (dispatching, then(Desk.raised, Desk.ended), "ERROR"),
    (dispatching, then(Desk.interrupt, Desk.dispatched, Desk.interrupted, Desk.ended), "IT"),
    (running, then(Desk.terminated, Desk.ended), "S_DONE"),
    (running, then(lambda d: d.terminated("STUCK"), Desk.ended), "S_STUCK"),
    (running, then(Desk.terminated, lambda d: d.ended(held=False)), "N_DONE"),
    (running, then(Desk.terminated, Desk.violated, Desk.ended), "RI"),
    (running, then(Desk.terminated, lambda d: d.answer(VIOLATED)), "RI"),
    (running, then(Desk.terminated, lambda d: d.answer(REFUSED)), "LOST"),
    (running, then(Desk.terminated, lambda d: d.terminated("STUCK"), Desk.ended), "S_DONE"),
    (running, then(Desk.terminated, Desk.interrupt, Desk.ended), "S_DONE"),
    (running, then(lambda d: d.terminated("DOEN"), Desk.ended), "ERROR"),
    (running, then(lambda d: d.terminated("DONE", {"distance": float("nan")}), Desk.ended), "ERROR"),
    (running, Desk.violated, "RI"),
    (running, then(Desk.raised, Desk.ended), "ERROR"),
    (running, then(Desk.failed, Desk.ended), "ERROR"),
    (running, lambda d: d.step(lost()), "LOST"),
    (interrupting, then(Desk.interrupted, Desk.ended), "IT"),
    (interrupting, then(Desk.terminated, Desk.ended), "S_DONE"),
    (interrupting, Desk.violated, "RI"),
    (interrupting, then(lambda d: d.wait(2.0), Desk.ended), "IT"),
    (interrupting, then(Desk.failed, Desk.ended), "ERROR"),
    (running, lambda d: d.renewed(VIOLATED), "RI"),
    (running, lambda d: d.renewed(REFUSED), "LOST"),
    (running, lambda d: d.renewed(ErrorReply(code=ErrorCode.UNKNOWN_GOAL, message="Never heard of it.")), "LOST"),
    (interrupting, lambda d: d.renewed(REFUSED), "LOST"),
    (running, then(Desk.terminated, lambda d: d.renewed(ENDED), Desk.ended), "S_DONE"),
    (lambda: owned(validating=True), then(Desk.owner_gone, Desk.granted, Desk.ended), "IT"),
    (owned, then(Desk.owner_gone, Desk.interrupted, Desk.ended), "IT"),
]


def ended_by_predecessor() -> Ended:
    return Ended(goal_id="g", held=True, reason="", step=2, record="rm#2", how=EndKind.RESULT, result="DONE")


def lost() -> Lost:
    return Lost(goal_id="g", skill="move", reason="Gone.", t=0.0, step=3, record="rm#9", token=TOKEN)


@pytest.mark.parametrize(("context", "steps", "label"), ENDINGS)
def test_endings(context: Callable[[], Desk], steps: Callable[[Desk], None], label: str) -> None:
    desk = context()
    steps(desk)
    assert desk.terminal().label == label
    assert desk.terminal().reason
    assert desk.core.current is None
    assert desk.hooks.count(Hook.ENDED) == desk.hooks.count(Hook.DISPATCH), "every dispatched hook gets the end"
    desk.start()
    for late in (desk.terminated, desk.interrupted, desk.failed, desk.raised, desk.violated, desk.dispatched):
        late()
    desk.wait(1000.0)
    desk.interrupt()
    assert len(desk.terminals) == 1, "nothing gives a second answer"


def test_the_way_of_a_goal_is_one_chain_of_causes() -> None:
    desk = Desk()
    desk.start(cause="mission#1")
    desk.validated()
    desk.granted()
    desk.dispatched()
    desk.terminated(output={"distance": 3})
    desk.ended()
    assert [(record.before, record.after, record.cause) for record in desk.records] == [
        ("IDLE", "VALIDATING", "mission#1"),
        ("VALIDATING", "DISPATCHING", "rm#1"),
        ("DISPATCHING", "RUNNING", "skill/move#2"),
        ("RUNNING", "S_DONE", "rm#2"),
    ]
    assert desk.terminal().output == {"distance": 3.0}
    assert desk.terminal().success


@pytest.mark.parametrize("end", [lambda d: d.terminated("STUCK", cause="rm#7"), lambda d: d.failed(cause="rm#7")])
def test_an_end_is_put_down_to_what_its_developer_names(end: Callable[[Desk], None]) -> None:
    desk = running()
    end(desk)
    assert desk.asked.call.cause == "rm#7"


@pytest.mark.parametrize(
    "end",
    [
        lambda d: d.terminated("STUCK"),
        lambda d: d.failed(),
        lambda d: d.raised(),
        lambda d: d.terminated("NO_SUCH_RESULT"),
        lambda d: d.terminated("DONE", {"distance": "far"}),
    ],
)
def test_a_failure_that_nobody_explains_comes_of_the_request_to_stop_and_never_of_the_start(
    end: Callable[[Desk], None],
) -> None:
    desk = running()
    end(desk)
    assert desk.asked.call.cause is None
    desk = interrupting()
    request = desk.records[-1].id
    end(desk)
    assert desk.asked.call.cause == request


def test_a_result_is_reported_with_its_name_and_the_phrase_of_its_developer() -> None:
    desk = running()
    desk.step(Terminated("g", "DONE", why="the tape was reached"))
    assert desk.ends_asked == [("result", "DONE", TOKEN)]
    desk.ended()
    assert desk.terminal().reason == "The skill ended with DONE: the tape was reached."


def test_a_hook_that_ends_its_own_goal_is_still_seen_to_return() -> None:
    """`on_dispatch` may end the goal; the phase is RUNNING as soon as that hook is over, as for any other goal."""
    desk = dispatching()
    desk.terminated()
    assert desk.state is State.DISPATCHING
    desk.dispatched()
    assert desk.state is State.RUNNING
    desk.ended()
    assert [record.after for record in desk.records[-2:]] == ["RUNNING", "S_DONE"]


def test_a_cause_that_cannot_be_sent_holds_no_end_up() -> None:
    desk = running()
    desk.terminated(cause="\ud800" + "a" * MAX_MESSAGE_BYTES)
    assert len(encode(desk.asked.call)) < MAX_MESSAGE_BYTES


def test_a_failure_that_held_is_no_success() -> None:
    desk = running()
    desk.terminated("STUCK")
    desk.ended()
    assert not desk.terminal().success


def test_inputs_reach_hooks_and_preconditions_with_defaults() -> None:
    desk = validating()
    [validate] = [action for action in desk.actions if isinstance(action, CallHook)]
    assert validate.inputs == {"speed": 1.0, "label": "a"}
    assert isinstance(desk.asked.call, BeginGoal)
    assert desk.asked.call.inputs == {"speed": 1.0, "label": "a"}


def test_a_refused_input_is_named() -> None:
    desk = Desk()
    desk.start(inputs={"speed": 9.0, "lable": "x"})
    desk.outcome_committed()
    assert set(desk.terminal().failing) == {"speed", "lable"}
    assert "between 0.1 and 3" in desk.terminal().reason
    assert desk.hooks == []


class Unread(dict[str, object]):
    """Inputs that nobody may look at."""

    def __iter__(self) -> Iterator[str]:
        raise AssertionError("somebody has looked")


def test_a_busy_skill_spends_no_time_on_the_inputs() -> None:
    desk = running()
    desk.start("other", inputs=Unread(speed=1.0))
    desk.outcome_committed()
    assert desk.terminal("other").label == "BUSY"


def test_start_again_with_the_same_id_runs_nothing_twice() -> None:
    desk = running()
    count = len(desk.actions)
    desk.start()
    desk.start(schema="other", deadline=-1.0)
    assert len(desk.actions) == count
    assert desk.state is State.RUNNING


def test_mistake_busy_answers_the_running_goal() -> None:
    desk = running()
    desk.start("new")
    desk.outcome_committed()
    assert desk.state is State.RUNNING
    assert desk.terminal("new").ending is Ending.BUSY
    assert desk.terminal("new").running_goal == "g"
    assert [goal_id for goal_id, _ in desk.terminals] == ["new"]
    desk.terminated()
    desk.ended()
    assert desk.terminal().label == "S_DONE"


def test_a_flood_of_new_callers_makes_nobody_forget_the_running_goal() -> None:
    desk = running()
    for number in range(GOALS_REMEMBERED + 10):
        desk.start(f"new{number}")
        desk.outcome_committed()
    assert desk.state is State.RUNNING
    count = len(desk.actions)
    desk.start()
    assert len(desk.actions) == count
    with pytest.raises(RefusedError):
        desk.core.status("new0")


def test_a_foreign_schema_is_refused() -> None:
    desk = Desk()
    with pytest.raises(RefusedError) as refusal:
        desk.start(schema="abcd")
    assert refusal.value.code is ErrorCode.SCHEMA_MISMATCH


def test_calls_for_goals_that_are_over_are_dropped_and_counted() -> None:
    desk = running()
    desk.terminated(goal_id="old")
    desk.interrupted()
    assert desk.core.dropped_calls == 2
    assert desk.state is State.RUNNING
    assert desk.ends_asked == []


def test_a_goal_is_validated_once_and_not_after_it_is_over() -> None:
    desk = validating()
    count = len(desk.actions)
    desk.validated()
    assert len(desk.actions) == count
    desk.violated()
    count = len(desk.actions)
    desk.validated()
    desk.validated("Too windy.")
    assert len(desk.actions) == count


@pytest.mark.parametrize(("give_up", "reason"), [(Desk.failed, "The motor is gone."), (Desk.raised, "ValueError: oh")])
def test_a_goal_that_is_given_up_says_why_and_asks_for_the_effect_of_a_loss(
    give_up: Callable[[Desk], None], reason: str
) -> None:
    desk = running()
    give_up(desk)
    assert desk.ends_asked == [("error", None, TOKEN)]
    assert desk.core.dropped_calls == 0
    desk.ended()
    assert reason in desk.terminal().reason
    desk.failed()
    assert desk.core.dropped_calls == 1
