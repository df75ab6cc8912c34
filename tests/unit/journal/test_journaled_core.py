"""A core and its journal never part: not when a write fails, nor when a step breaks halfway."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from skillwing.dsl import parse
from skillwing.services.core.resource_core import ResourceCore
from skillwing.services.ids import RecordIds
from skillwing.services.journal.errors import (
    JournalTakenError,
    JournalUnreadableError,
    JournalWriteError,
)
from skillwing.services.journal.journal import Journal
from skillwing.services.journal.schema import Identity
from skillwing.services.managers.journaled_core import JournaledCore, TakeStep, UnwrittenError
from skillwing.services.protocol import (
    BeginGoal,
    DataSample,
    GoalVerdict,
    Granted,
    Record,
)

LINE = parse(
    """
    skillset line {
        data { permit: float64 }
        resource belt { initial FREE  FREE -> TAKEN  TAKEN -> FREE }
        skill pack {
            effect { take: belt -> TAKEN  drop: belt -> FREE }
            precondition {
                free: resource=(belt == FREE)
                permitted: data=(permit > 0.0)
                success take
            }
            interrupt { apply=drop }
            result { success PACKED: apply=drop }
        }
    }
    """,
    "line.skillset",
)
IDENTITY = Identity("r1", LINE.name, LINE.schema_hash)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "journal.sqlite"


def judge(path: Path, now: float | None = None, *, follows_time: bool = False) -> JournaledCore:
    """A judge on the journal, which takes it from any earlier one. now: by default when that one took its last step."""
    ids = RecordIds("rm")
    journal = Journal(path, IDENTITY)
    judge = JournaledCore(
        journal, lambda kept, data: ResourceCore(LINE, source="rm", new_record_id=ids, kept=kept, data=data)
    )
    kept = journal.snapshot()
    if kept is None:
        judge.begin(0.0)
    else:
        now = kept.t if now is None else now
        if judge.resume(kept, now, follows_time=follows_time):
            judge.take(lambda core, now: core.resume(kept, now), now)
    return judge


def begin(goal_id: str) -> TakeStep[GoalVerdict]:
    request = BeginGoal(
        goal_id=goal_id, skill="pack", inputs={}, manager="skill/pack", owner="c", schema=LINE.schema_hash
    )
    return lambda core, now: core.begin(request, now)


def permit(value: float) -> TakeStep[None]:
    return lambda core, now: core.update_datum(DataSample(name="permit", value=value, t=now), now)


def fails(error: Exception) -> Callable[..., None]:
    def fail(*arguments: object) -> None:
        raise error

    return fail


def test_a_grant_is_in_the_journal_or_there_is_none(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The disk fails: the write, and then reading what was written before."""
    first = judge(path)
    first.take(permit(1.0), 1.0)
    with monkeypatch.context() as disk:
        disk.setattr(Journal, "write", fails(JournalWriteError(path, "the disk fails")))
        with pytest.raises(UnwrittenError, match="the disk fails"):
            first.take(begin("a"), 1.0)
        assert first.core.grants == ()
        disk.setattr(Journal, "kept", fails(JournalUnreadableError(path, "the disk fails")))
        with pytest.raises(JournalUnreadableError):
            first.take(begin("a"), 1.0)


@pytest.mark.parametrize("breaks", ["_enforce_invariants", "_finish"])
def test_nothing_is_left_of_a_step_that_breaks(path: Path, monkeypatch: pytest.MonkeyPatch, breaks: str) -> None:
    first = judge(path)
    first.take(permit(1.0), 1.0)
    with monkeypatch.context() as mistake:
        mistake.setattr(ResourceCore, breaks, fails(ZeroDivisionError()))
        with pytest.raises(ZeroDivisionError):
            first.take(begin("a"), 1.0)
    assert first.core.grants == ()
    assert first.core.states == {"belt": "FREE"}
    step = first.take(begin("b"), 2.0)
    assert isinstance(step.reply, Granted)
    assert {each.goal_id for each in step.publications if isinstance(each, Record) and each.after == "GRANTED"} == {"b"}
    assert judge(path).core.grants == first.core.grants


def test_whoever_has_lost_the_journal_does_not_even_answer(path: Path) -> None:
    """The later process may have taken the goal away, and granted another one what it held."""
    earlier = judge(path)
    earlier.take(permit(1.0), 1.0)
    earlier.take(begin("a"), 1.0)
    judge(path)
    with pytest.raises(JournalTakenError, match="Another process goes on"):
        earlier.take(begin("a"), 2.0)
    with pytest.raises(JournalTakenError, match="Another process goes on"):
        earlier.take(permit(1.0), 2.0)


def test_a_lasting_value_that_could_not_be_written_is_written_later(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same value again is no change, and still it has to get into the journal."""
    first = judge(path)
    with monkeypatch.context() as disk:
        disk.setattr(Journal, "write", fails(JournalWriteError(path, "the disk is full")))
        with pytest.raises(UnwrittenError):
            first.take(permit(1.0), 1.0)
    first.take(permit(1.0), 2.0)
    assert isinstance(judge(path).take(begin("a"), 3.0).reply, Granted)


def test_nobody_loses_a_grant_because_somebody_sets_the_clock_back(path: Path) -> None:
    first = judge(path)
    first.take(permit(1.0), 1e9)
    granted = first.take(begin("a"), 1e9).reply
    assert isinstance(granted, Granted)
    later = judge(path, 1e9 - 3600.0)
    assert later.core.grants == first.core.grants
    # Nor does what was measured before shut out what is measured from now on.
    later.take(permit(2.0), 1e9 - 3599.0)
    assert later.core.data.value("permit") == 2.0
    later.take(lambda core, now: core.goal_lost("a", now, "silence"), 1e9 - 3599.0)
    next_one = later.take(begin("b"), 1e9 - 3598.0).reply
    assert isinstance(next_one, Granted)
    assert next_one.token > granted.token


def test_where_the_world_begins_anew_nothing_is_held_and_no_token_is_given_twice(path: Path) -> None:
    first = judge(path)
    first.take(permit(1.0), 50.0)
    granted = first.take(begin("a"), 50.0).reply
    assert isinstance(granted, Granted)
    world = judge(path, 0.5, follows_time=True)
    assert world.core.grants == ()
    assert world.core.states == {"belt": "FREE"}
    assert path.with_name("journal-1.sqlite").exists()
    # Not even when the new one dies at once.
    world = judge(path, 0.6, follows_time=True)
    world.take(permit(1.0), 1.0)
    next_one = world.take(begin("b"), 1.0).reply
    assert isinstance(next_one, Granted)
    assert next_one.token > granted.token
