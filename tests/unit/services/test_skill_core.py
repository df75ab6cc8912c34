"""Figure 5, transition by transition."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import msgspec
import pytest
from rig import RIG
from skill_desk import ENDED, REFUSED, TOKEN, VIOLATED, Desk, dispatching, interrupting, owned, running, validating

from skillwing.services.core.memory import Recent
from skillwing.services.core.refusal import RefusedError
from skillwing.services.core.skill_actions import AskResources, CallHook, Hook
from skillwing.services.core.skill_core import GOALS_REMEMBERED, RENEWALS_UNTIL_UNWATCHED, SILENCES_UNTIL_ERROR
from skillwing.services.protocol import (
    MAX_MESSAGE_BYTES,
    BeginGoal,
    EndGoal,
    Ending,
    ErrorCode,
    ErrorReply,
    Granted,
    Lost,
    NotReady,
    Record,
    RenewGoal,
    State,
    Terminal,
    encode,
)


def then(*steps: Callable[[Desk], None]) -> Callable[[Desk], None]:
    def play(desk: Desk) -> None:
        for step in steps:
            step(desk)

    return play


ENDINGS: list[tuple[Callable[[], Desk], Callable[[Desk], None], str]] = [
    (Desk, then(lambda d: d.start(inputs={"speed": 9.0}), Desk.granted_to_nobody), "NV"),
    (Desk, then(Desk.start, lambda d: d.validated("Too windy."), Desk.granted_to_nobody), "NV"),
    (Desk, then(Desk.start, Desk.raised, Desk.granted_to_nobody), "ERROR"),
    (validating, lambda d: d.answer(NotReady(goal_id="g", failing={"free": "It is not."}, record="rm#1")), "NR"),
    (validating, lambda d: d.answer(VIOLATED), "RI"),
    (validating, then(Desk.violated, Desk.granted, Desk.ended), "RI"),
    (validating, then(Desk.interrupt, Desk.granted, Desk.ended), "IT"),
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
    (running, lambda d: d.take(d.core.pushed(lost(), 0.0)), "LOST"),
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


def lost() -> Lost:
    return Lost(goal_id="g", skill="move", reason="Gone.", t=0.0, record="rm#9", token=TOKEN)


@pytest.mark.parametrize(("context", "steps", "label"), ENDINGS)
def test_endings(context: Callable[[], Desk], steps: Callable[[Desk], None], label: str) -> None:
    desk = context()
    steps(desk)
    assert desk.terminal().label == label
    assert desk.terminal().reason
    assert desk.core.current is None
    assert desk.hooks.count(Hook.ENDED) == desk.hooks.count(Hook.DISPATCH), "whoever was dispatched is told of the end"
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
    records = [action for action in desk.actions if hasattr(action, "subject")]
    assert [(r.before, r.after, r.cause) for r in records] == [  # pyright: ignore[reportAttributeAccessIssue]
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
    desk.granted_to_nobody()
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
    desk.granted_to_nobody()
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
    desk.granted_to_nobody()
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
        desk.granted_to_nobody()
    assert desk.state is State.RUNNING
    count = len(desk.actions)
    desk.start()
    assert len(desk.actions) == count
    with pytest.raises(RefusedError):
        desk.core.status("new0")


def test_mistake_halt_before_the_acknowledgement_orphans_the_goal() -> None:
    desk = Desk()
    with pytest.raises(RefusedError) as refusal:
        desk.interrupt()
    assert refusal.value.code is ErrorCode.UNKNOWN_GOAL
    desk.start()
    desk.granted_to_nobody()
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


@pytest.mark.parametrize(("context", "how"), [(validating, None), (running, "DONE")])
def test_silence_of_the_resource_manager_is_asked_again_and_ends_in_an_answer(
    context: Callable[[], Desk], how: str | None
) -> None:
    desk = context()
    if how:
        desk.terminated(how)
    first = desk.asked.call
    for silences in range(1, SILENCES_UNTIL_ERROR):
        desk.answer(None)
        assert desk.asked == AskResources(first, silences)
    assert desk.terminals == []
    desk.answer(None)
    assert desk.terminal().ending is Ending.ERROR
    assert "resource manager does not answer" in desk.terminal().reason
    settling = desk.asked.call
    assert isinstance(settling, EndGoal), "what may have been granted is still to be given back"
    assert settling.incarnation == "this", "by this process, and by no other of its name"
    desk.answer(None)
    assert desk.asked == AskResources(settling, SILENCES_UNTIL_ERROR + 1)
    count = len(desk.actions)
    desk.ended()
    assert len(desk.actions) == count


def test_an_empty_reply_is_no_refusal() -> None:
    desk = validating()
    desk.answer(None)
    desk.granted()
    assert desk.state is State.DISPATCHING


# --- leases and owners -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("context", "held"),
    [(Desk, False), (validating, False), (dispatching, True), (running, True), (interrupting, True)],
)
def test_a_grant_is_renewed_for_as_long_as_it_is_held(context: Callable[[], Desk], held: bool) -> None:
    renewal = context().core.renewal()
    assert renewal == (RenewGoal(goal_id="g", skill="move", token=TOKEN) if held else None)


def test_a_grant_is_renewed_until_its_end_is_acknowledged() -> None:
    desk = running()
    desk.terminated()
    assert desk.core.renewal() is not None
    desk.ended()
    assert desk.core.renewal() is None


@pytest.mark.parametrize(
    "answer",
    [
        None,
        Granted(goal_id="g", token=TOKEN, revision=1, record="rm#1"),
        ErrorReply(code=ErrorCode.INTERNAL, message="The disk is full."),
    ],
)
def test_a_renewal_without_a_verdict_changes_nothing(answer: Any) -> None:
    desk = running()
    count = len(desk.actions)
    desk.renewed(answer)
    assert len(desk.actions) == count
    assert desk.state is State.RUNNING


@pytest.mark.parametrize("answer", [None, ErrorReply(code=ErrorCode.UNAVAILABLE, message="Its disk is full.")])
def test_a_goal_whose_invariants_nobody_watches_is_asked_to_stop(answer: Any) -> None:
    desk = running()
    for _ in range(RENEWALS_UNTIL_UNWATCHED - 1):
        desk.renewed(answer)
    desk.renewed(Granted(goal_id="g", token=TOKEN, revision=1, record="rm#1"))
    for _ in range(RENEWALS_UNTIL_UNWATCHED - 1):
        desk.renewed(answer)
    assert desk.state is State.RUNNING
    desk.renewed(answer)
    assert desk.state is State.INTERRUPTING
    assert desk.hooks[-1] is Hook.INTERRUPT
    desk.renewed(answer)
    desk.interrupted()
    desk.ended()
    assert desk.terminal().label == "IT"
    assert desk.terminal().reason == "The resource manager is silent, and nobody watches the invariants."


def test_a_verdict_on_a_renewal_has_the_hooks_stop() -> None:
    desk = running()
    desk.renewed(REFUSED)
    assert desk.hooks[-1] is Hook.ENDED
    assert desk.terminal().reason == REFUSED.message


def test_a_verdict_on_an_old_goal_leaves_the_next_one_alone() -> None:
    desk = running()
    desk.take(desk.core.renewed(RenewGoal(goal_id="old", skill="move", token=3), REFUSED, 0.0))
    assert desk.state is State.RUNNING


def test_a_goal_whose_owner_is_gone_is_asked_to_stop_and_says_why() -> None:
    desk = owned()
    desk.owner_gone()
    assert desk.state is State.INTERRUPTING
    assert desk.hooks[-1] is Hook.INTERRUPT
    desk.interrupted()
    desk.ended()
    assert desk.terminal().reason == "Its owner mission-1 is gone."


@pytest.mark.parametrize("context", [running, owned])
def test_the_end_of_another_client_is_nothing_to_a_goal(context: Callable[[], Desk]) -> None:
    desk = context()
    desk.owner_gone("client/mission-2")
    assert desk.state is State.RUNNING


def test_a_skill_may_go_on_without_its_owner() -> None:
    skills = tuple(replace(skill, owner_lost="continue") for skill in RIG.skills)
    desk = owned(skillset=replace(RIG, skills=skills))
    desk.owner_gone()
    assert desk.state is State.RUNNING


# --- what the hooks and the resource manager are told ----------------------------------------------------------------


def test_hooks_are_told_token_begin_and_end_of_their_goal() -> None:
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
    validating, _, running_ = [action for action in desk.actions if isinstance(action, Record)]
    begin, end = (action.call for action in desk.actions if isinstance(action, AskResources))
    assert isinstance(begin, BeginGoal)
    assert (begin.cause, begin.manager, begin.incarnation) == (validating.id, "skill/move", "this")
    assert isinstance(end, EndGoal)
    assert (end.cause, end.incarnation) == (running_.id, "this")
    desk.ended()
    records = [action for action in desk.actions if isinstance(action, Record)]
    assert [record.goal_id for record in records] == ["g"] * 4
    assert "test" in records[0].text, "who has asked for it"


def test_an_interrupt_is_on_record_with_its_cause_and_who_asked_for_it() -> None:
    desk = interrupting()
    record = [action for action in desk.actions if isinstance(action, Record)][-1]
    assert (record.after, record.cause, record.text) == ("INTERRUPTING", "mission#1", "test interrupted it.")
    desk = running()
    before = [action for action in desk.actions if isinstance(action, Record)][-1]
    desk.wait(60.0)
    record = [action for action in desk.actions if isinstance(action, Record)][-1]
    assert (record.after, record.cause) == ("INTERRUPTING", before.id), "where nobody has asked it comes of the goal"


@pytest.mark.parametrize(
    ("answer", "record"),
    [
        (NotReady(goal_id="g", failing={"free": "It is not."}, record="rm#1"), "rm#1"),
        (VIOLATED, "rm#9"),
        (ENDED, "rm#2"),
        (msgspec.structs.replace(ENDED, terminal=Terminal(ending=Ending.BUSY, reason="It is.")), "rm#2"),
    ],
)
def test_an_end_by_the_resource_manager_comes_of_its_record(answer: Any, record: str) -> None:
    desk = validating()
    desk.answer(answer)
    last = [action for action in desk.actions if isinstance(action, Record)][-1]
    assert (last.after, last.cause) == (desk.terminal().label, record)


def test_an_answer_to_no_open_question_ends_nothing() -> None:
    """It may be about a goal of the same id that has long been forgotten."""
    desk = running()
    old = EndGoal(goal_id="g", skill="move", token=3, how="interrupt")
    desk.take(desk.core.answered(AskResources(old), ENDED, desk.now))
    assert desk.state is State.RUNNING


# --- memory ----------------------------------------------------------------------------------------------------------


def test_memory_stays_bounded() -> None:
    desk = Desk()
    for number in range(3 * GOALS_REMEMBERED):
        with pytest.raises(RefusedError):
            desk.interrupt(f"unknown{number}")
        desk.start(f"bad{number}", inputs={"speed": 9.0})
        desk.granted_to_nobody()
    with pytest.raises(RefusedError):
        desk.core.status("bad0")
    desk.core.status(f"bad{3 * GOALS_REMEMBERED - 1}")


def test_what_was_written_last_is_remembered_longest() -> None:
    memory: Recent[str, int] = Recent(3)
    for key in ("a", "b", "c"):
        memory[key] = 1
    assert len(memory) == 3, "as many as there is room for"
    memory["a"] = 2
    assert memory.newest() == 2
    memory["d"] = 3
    assert [memory.get(key) for key in ("a", "b", "c", "d")] == [2, None, 1, 3]
    assert memory.pop("d") == 3
    assert memory.pop("d") is None
    assert "d" not in memory


def test_an_interrupt_that_came_early_ends_one_goal_and_is_forgotten() -> None:
    desk = Desk()
    for _ in range(2):
        with pytest.raises(RefusedError):
            desk.interrupt()
    desk.start()
    desk.granted_to_nobody()
    for number in range(GOALS_REMEMBERED):
        desk.start(f"bad{number}", inputs={"speed": 9.0})
        desk.granted_to_nobody()
    with pytest.raises(RefusedError):
        desk.core.status("g")
    desk.start()
    assert desk.state is State.VALIDATING
    assert desk.core.current is not None


def test_a_resource_manager_that_cannot_judge_now_is_asked_again() -> None:
    desk = Desk()
    desk.start()
    desk.validated()
    first = desk.asked.call
    desk.answer(ErrorReply(code=ErrorCode.UNAVAILABLE, message="Its disk is full."))
    assert desk.asked == AskResources(first, 1)
    desk.granted()
    assert desk.core.current is not None
