"""A core and its journal never part: not when a write fails, nor when a step breaks halfway."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from skillwing.dsl import parse
from skillwing.services.core import grants
from skillwing.services.core.events import GoalSilent, Resumed
from skillwing.services.core.outbox import Outbox
from skillwing.services.core.resource_core import ResourceCore
from skillwing.services.ids import RecordIds
from skillwing.services.journal.errors import (
    JournalTakenError,
    JournalUnreadableError,
    JournalWriteError,
)
from skillwing.services.journal.journal import Journal
from skillwing.services.journal.schema import Identity
from skillwing.services.managers.journaled_core import JournaledCore, UnwrittenError
from skillwing.services.protocol import (
    BeginGoal,
    DataSample,
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


def journaled(path: Path, now: float | None = None, *, follows_time: bool = False) -> JournaledCore:
    """A core that takes the journal over from any earlier one. now: by default the time of that one's last step."""
    ids = RecordIds("rm")
    journal = Journal(path, IDENTITY)
    core = JournaledCore(
        journal, lambda snapshot, data: ResourceCore(LINE, source="rm", new_record_id=ids, snapshot=snapshot, data=data)
    )
    kept = journal.snapshot()
    if kept is None:
        core.begin(0.0, "first")
    else:
        now = kept.t if now is None else now
        if core.resume(kept, now, follows_time=follows_time, epoch="second"):
            core.step(Resumed(), now)
    return core


def begin(goal_id: str) -> BeginGoal:
    return BeginGoal(goal_id=goal_id, skill="pack", inputs={}, manager="skill/pack", owner="c", schema=LINE.schema_hash)


def permit(value: float, t: float) -> DataSample:
    return DataSample(name="permit", value=value, t=t)


def fails(error: Exception) -> Callable[..., None]:
    def fail(*arguments: object) -> None:
        raise error

    return fail


def test_a_grant_is_in_the_journal_or_there_is_none(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The disk fails: the write, and then reading what was written before."""
    first = journaled(path)
    first.step(permit(1.0, 1.0), 1.0)
    with monkeypatch.context() as disk:
        disk.setattr(Journal, "write", fails(JournalWriteError(path, "the disk fails")))
        with pytest.raises(UnwrittenError, match="the disk fails"):
            first.step(begin("a"), 1.0)
        assert first.core.grants == ()
        disk.setattr(Journal, "snapshot", fails(JournalUnreadableError(path, "the disk fails")))
        with pytest.raises(JournalUnreadableError):
            first.step(begin("a"), 1.0)


@pytest.mark.parametrize(("place", "breaks"), [(grants, "enforce_invariants"), (Outbox, "drain")])
def test_nothing_is_left_of_a_step_that_breaks(
    path: Path, monkeypatch: pytest.MonkeyPatch, place: Any, breaks: str
) -> None:
    first = journaled(path)
    first.step(permit(1.0, 1.0), 1.0)
    with monkeypatch.context() as mistake:
        mistake.setattr(place, breaks, fails(ZeroDivisionError()))
        with pytest.raises(ZeroDivisionError):
            first.step(begin("a"), 1.0)
    assert first.core.grants == ()
    assert first.core.states == {"belt": "FREE"}
    step = first.step(begin("b"), 2.0)
    assert isinstance(step.reply, Granted)
    assert {each.goal_id for each in step.publications if isinstance(each, Record) and each.after == "GRANTED"} == {"b"}
    assert journaled(path).core.grants == first.core.grants


def test_a_manager_without_its_journal_does_not_answer(path: Path) -> None:
    """The later process may have taken the goal away, and granted another one what it held."""
    earlier = journaled(path)
    earlier.step(permit(1.0, 1.0), 1.0)
    earlier.step(begin("a"), 1.0)
    journaled(path)
    with pytest.raises(JournalTakenError, match="Another process goes on"):
        earlier.step(begin("a"), 2.0)
    with pytest.raises(JournalTakenError, match="Another process goes on"):
        earlier.step(permit(1.0, 2.0), 2.0)


def test_a_lasting_value_that_could_not_be_written_is_written_later(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same value again is no change, and still it has to get into the journal."""
    first = journaled(path)
    with monkeypatch.context() as disk:
        disk.setattr(Journal, "write", fails(JournalWriteError(path, "the disk is full")))
        with pytest.raises(UnwrittenError):
            first.step(permit(1.0, 1.0), 1.0)
    first.step(permit(1.0, 2.0), 2.0)
    assert isinstance(journaled(path).step(begin("a"), 3.0).reply, Granted)


def test_nobody_loses_a_grant_because_somebody_sets_the_clock_back(path: Path) -> None:
    first = journaled(path)
    first.step(permit(1.0, 1e9), 1e9)
    granted = first.step(begin("a"), 1e9).reply
    assert isinstance(granted, Granted)
    later = journaled(path, 1e9 - 3600.0)
    assert later.core.grants == first.core.grants
    # Nor does what was measured before shut out what is measured from now on.
    later.step(permit(2.0, 1e9 - 3599.0), 1e9 - 3599.0)
    assert later.core.data.value("permit") == 2.0
    later.step(GoalSilent("a", "silence"), 1e9 - 3599.0)
    next_one = later.step(begin("b"), 1e9 - 3598.0).reply
    assert isinstance(next_one, Granted)
    assert next_one.token > granted.token


def test_after_a_world_reset_nothing_is_held_and_no_token_repeats(path: Path) -> None:
    first = journaled(path)
    first.step(permit(1.0, 50.0), 50.0)
    granted = first.step(begin("a"), 50.0).reply
    assert isinstance(granted, Granted)
    world = journaled(path, 0.5, follows_time=True)
    assert world.core.grants == ()
    assert world.core.states == {"belt": "FREE"}
    assert path.with_name("journal-1.sqlite").exists()
    # Not even when the new one dies at once.
    world = journaled(path, 0.6, follows_time=True)
    world.step(permit(1.0, 1.0), 1.0)
    next_one = world.step(begin("b"), 1.0).reply
    assert isinstance(next_one, Granted)
    assert next_one.token > granted.token
