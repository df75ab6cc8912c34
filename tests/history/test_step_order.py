"""Judgement of published steps of which it is known whether they are in order."""

from __future__ import annotations

from collections.abc import Sequence

import pytest
from sequential_manager import Reply
from step_order import Observed, judge_order

from skillwing.services.protocol import GoalStatus, Granted, Record, RecordKind, ResourceStates, ResourceStep, State

EPOCH = "e"


def record(number: int, after: str, kind: RecordKind = RecordKind.RESOURCE, before: str = "") -> Record:
    return Record(id=f"rm#{number}", t=0.0, source="rm", kind=kind, subject="power", before=before, after=after)


def step(number: int, before: str, after: str, epoch: str = EPOCH) -> ResourceStep:
    return ResourceStep(number=number, epoch=epoch, t=0.0, records=(record(number, after, before=before),))


def returned(number: int) -> ResourceStep:
    return ResourceStep(number=number, epoch=EPOCH, t=0.0, records=(record(number, "RESUMED", RecordKind.PROCESS),))


def states(number: int, power: str, epoch: str = EPOCH) -> ResourceStates:
    return ResourceStates(step=number, epoch=epoch, states={"power": power}, t=0.0)


def granted(number: int, record_id: str) -> Granted:
    return Granted(goal_id="g", token=1, step=number, record=record_id)


OFF, ON, AGAIN = step(8, "ON", "OFF"), step(9, "OFF", "ON"), step(10, "ON", "OFF")
BACK = returned(10)


def problems(
    steps: Sequence[ResourceStep], replies: Sequence[Reply] = (), stored: Sequence[int] | None = None, kills: int = 0
) -> list[str]:
    ids = None if stored is None else tuple(f"rm#{number}" for number in stored)
    return judge_order(Observed(states(7, "ON"), tuple(steps), ids, kills), replies).problems


def test_steps_replies_and_journal_that_agree() -> None:
    assert problems([], [states(7, "ON")], []) == []
    assert problems([OFF, ON], [states(9, "ON"), states(8, "OFF"), granted(9, "rm#9")], [8, 9]) == []
    assert problems([OFF, OFF, ON]) == [], "the same step twice does no harm"


def test_a_killed_process_may_have_kept_its_last_steps_to_itself() -> None:
    order = judge_order(Observed(states(7, "ON"), (OFF, BACK), ("rm#8", "rm#9", "rm#10"), 1), [states(10, "ON")])
    assert (order.problems, order.missing_steps) == ([], 1)
    assert problems([OFF, BACK], [states(9, "ON"), states(10, "ON")], [8, 9, 10], kills=1) == []
    assert problems([OFF, ON, BACK], [], [8, 9, 10], kills=1) == []


@pytest.mark.parametrize(
    ("steps", "problem"),
    [
        ([OFF, step(8, "ON", "ON")], "Step 8 was published twice, with different content."),
        ([OFF, AGAIN], "Step 10 was published after step 8, and nobody was killed."),
        ([ON, OFF], "Step 8 was published after step 9."),
        ([step(8, "ON", "OFF", "other")], "Step 8 belongs to another epoch."),
        ([OFF, ON, BACK], "The process has returned 1 times, and was killed 0 times."),
        ([OFF, step(9, "ON", "OFF")], "Step 9 finds power ON: it was OFF."),
    ],
)
def test_steps_that_are_out_of_order(steps: Sequence[ResourceStep], problem: str) -> None:
    assert problem in problems(steps)


@pytest.mark.parametrize(
    "reply",
    [
        states(8, "ON"),
        states(7, "OFF"),
        states(9, "OFF"),
        states(8, "OFF", "other"),
        states(10, "ON"),
        granted(8, "rm#9"),
        granted(10, "rm#9"),
    ],
)
def test_replies_that_differ_from_the_steps(reply: Reply) -> None:
    assert len(problems([OFF, ON], [reply])) == 1


def test_replies_after_a_missing_step_have_to_agree_with_each_other() -> None:
    found = problems([OFF, BACK, step(11, "ON", "OFF")], [states(10, "ON"), states(11, "ON")], kills=1)
    assert found == ["A reply has {'power': 'ON'} after step 11 of epoch e: it left {'power': 'OFF'}."]


@pytest.mark.parametrize(
    ("steps", "stored"),
    [
        ([OFF, BACK], [8, 10]),
        ([OFF, ON], [9]),
        ([OFF, ON], [8, 9, 10]),
        ([OFF, ON], [8, 3, 9]),
        ([OFF, returned(11)], [8, 9, 11]),
    ],
)
def test_steps_that_differ_from_the_journal(steps: Sequence[ResourceStep], stored: Sequence[int]) -> None:
    assert len(problems(steps, [], stored, kills=1)) == 1


def status(after_step: int, cause: str | None) -> GoalStatus:
    return GoalStatus(goal_id="g", skill="lift", state=State.RUNNING, t=0.0, cause=cause, after_step=after_step)


def problems_of(*statuses: GoalStatus, stored: tuple[str, ...] | None = None, kills: int = 0) -> list[str]:
    steps = (step_of("resource_manager~a#1", 8), step_of("resource_manager~a#2", 9))
    return judge_order(Observed(states(7, "ON"), steps, stored, kills, statuses), []).problems


def step_of(record_id: str, number: int) -> ResourceStep:
    record = Record(
        id=record_id, t=0.0, source="rm", kind=RecordKind.GOAL, subject="lift", before=None, after="GRANTED"
    )
    return ResourceStep(number=number, epoch=EPOCH, t=0.0, records=(record,))


def test_statuses_that_name_the_step_of_their_cause_or_a_later_one() -> None:
    asked, granted, runs = status(0, "client~b#1"), status(8, "resource_manager~a#1"), status(8, "skill/lift~c#1")
    assert problems_of(asked, granted, runs, status(9, "resource_manager~a#2")) == []
    assert problems_of(status(9, "resource_manager~a#1"), status(0, None)) == []


@pytest.mark.parametrize(
    ("wrong", "problem"),
    [
        (status(8, "resource_manager~a#2"), "names step 8. Its cause belongs to step 9."),
        (status(0, "resource_manager~a#1"), "names step 0. Its cause belongs to step 8."),
        (status(10, "resource_manager~a#2"), "names step 10: the last one was 9."),
        (status(9, "resource_manager~a#3"), "names step 9. No step has its cause, resource_manager~a#3."),
    ],
)
def test_statuses_that_do_not_name_their_step(wrong: GoalStatus, problem: str) -> None:
    (found,) = problems_of(wrong)
    assert problem in found


def test_a_status_may_follow_from_a_step_that_was_stored_and_not_sent() -> None:
    stored = tuple(f"resource_manager~a#{number}" for number in (1, 2, 3))
    found = problems_of(status(9, "resource_manager~a#3"), stored=stored, kills=1)
    assert not any("its cause" in problem.lower() for problem in found)
