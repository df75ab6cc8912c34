"""The journal's file: what it survives, what it refuses and what it says then, and that it stays small."""

from __future__ import annotations

import re
import sqlite3
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import msgspec
import pytest

from skillwing.services.core.bounded_dict import GOALS_REMEMBERED
from skillwing.services.core.ledger import Ledger
from skillwing.services.core.snapshot import DatumEntry, FinishedGoal, GrantEntry, ManagerEntry, ResourceEntry, Snapshot
from skillwing.services.journal import rows
from skillwing.services.journal.checkpoints import CHECKPOINT, WRITES_BETWEEN
from skillwing.services.journal.errors import (
    JournalRefusedError,
    JournalTakenError,
    JournalUnreadableError,
    JournalWriteError,
    NoJournalError,
)
from skillwing.services.journal.journal import ROOM, Journal, look_into, set_aside
from skillwing.services.journal.rows import HISTORY_KEPT, MANAGERS_KEPT, TRIM_EVERY
from skillwing.services.journal.schema import FORMAT, Identity, damaged
from skillwing.services.protocol import NO_TOKEN, Granted, NotReady, Record, RecordKind

ME = Identity("r1", "crane", "0123456789abcdef")


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "journal.sqlite"


@pytest.fixture
def journal(path: Path) -> Iterator[Journal]:
    journal = Journal(path, ME)
    journal.write((ResourceEntry("hook", "FREE", 0, ""),), (), 0.0, 0)
    yield journal
    journal.close()


def opened(number: int) -> GrantEntry:
    granted = Granted(goal_id=f"g{number}", token=number, step=1, record=f"rm#{number}")
    return GrantEntry("lift", {"load": 1.5, "name": "Käfig"}, "skill/lift", "a", granted)


def over(number: int) -> FinishedGoal:
    return FinishedGoal(
        f"g{number}", "lift", number, NotReady(step=1, goal_id=f"g{number}", failing={"calm": "no"}, record="rm#1")
    )


def record(number: int) -> Record:
    return Record(id=f"rm#{number}", t=1.0, source="rm", kind=RecordKind.GOAL, subject="x", before=None, after="y")


def held(journal: Journal) -> Snapshot:
    kept = journal.snapshot()
    assert kept is not None
    return kept


def entries_of_every_kind() -> tuple[object, ...]:
    return (
        ResourceEntry("hook", "TAKEN", 1, "rm#1"),
        opened(1),
        opened(2),
        over(1),
        ManagerEntry("skill/lift", "a"),
        DatumEntry("limit", {"x": 1.0, "names": ["a", "b"]}, 0.5),
    )


def test_everything_is_there_for_the_next_one(path: Path, journal: Journal) -> None:
    journal.write(entries_of_every_kind(), [record(1), record(2)], 2.5, 0)  # pyright: ignore[reportArgumentType]
    assert held(Journal(path, ME)) == Snapshot(
        resources=(ResourceEntry("hook", "TAKEN", 1, "rm#1"),),
        grants=(opened(2),),
        goals=(over(1),),
        managers=(ManagerEntry("skill/lift", "a"),),
        data=(DatumEntry("limit", {"x": 1.0, "names": ["a", "b"]}, 0.5),),
        last_token=2,
        records=(record(1), record(2)),
        t=2.5,
    )


def test_a_step_is_written_as_a_whole_or_not_at_all(journal: Journal, monkeypatch: pytest.MonkeyPatch) -> None:
    before = held(journal)
    monkeypatch.setattr(rows, "TRIM_EVERY", 1)
    monkeypatch.setattr(rows, "HISTORY_KEPT", None)  # The last statement of the transaction is the one that breaks.
    with pytest.raises(TypeError):
        journal.write((ResourceEntry("hook", "TAKEN", 1, "rm#1"), opened(1)), [record(1)], 2.5, 0)
    assert held(journal) == before


def test_what_was_written_outlives_a_writer_that_never_closes(path: Path, journal: Journal) -> None:
    """Remains of a killed process: the file and its write-ahead log, copied while the writer has both open."""
    journal.write((opened(1),), (), 1.0, 0)
    copy = path.with_name("copy.sqlite")
    for ending in ("", "-wal"):
        Path(f"{copy}{ending}").write_bytes(Path(f"{path}{ending}").read_bytes())
    assert held(Journal(copy, ME)).grants == (opened(1),)


def test_checkpoints_move_steps_into_the_file_beside_the_writes(path: Path, journal: Journal) -> None:
    for number in range(1, WRITES_BETWEEN):  # the fixture has written once
        journal.write((ResourceEntry("hook", "TAKEN", number, f"rm#{number}"),), (), 1.0, number)
    for thread in threading.enumerate():
        if thread.name == CHECKPOINT:
            thread.join()
    copy = path.with_name("copy.sqlite")
    copy.write_bytes(path.read_bytes())
    assert held(Journal(copy, ME)).step == WRITES_BETWEEN - 1, "without the write-ahead log"


def test_a_later_process_takes_the_journal_from_an_earlier_one(path: Path, journal: Journal) -> None:
    """A process that hung, was replaced and wakes up must not write what is long past."""
    later = Journal(path, ME)
    with pytest.raises(JournalTakenError, match=r"Another process goes on .* End this one"):
        journal.write((opened(1),), (), 1.0, 0)
    assert held(later).grants == ()
    later.write((opened(2),), (), 1.0, 0)
    assert held(later).grants == (opened(2),)


@pytest.mark.parametrize("another", [False, True], ids=["nothing in its place", "another one in its place"])
def test_a_journal_that_was_moved_away_is_not_written_until_it_is_back(
    path: Path, journal: Journal, another: bool
) -> None:
    away = path.with_name("elsewhere.sqlite")
    path.rename(away)
    if another:
        path.write_bytes(away.read_bytes())
    with pytest.raises(JournalWriteError, match=r"deleted or moved away\. Move it back"):
        journal.write((ResourceEntry("hook", "USED", 1, "rm#1"),), (), 1.0, 0)
    with pytest.raises(JournalWriteError):
        journal.check_hold()
    away.replace(path)
    journal.check_hold()
    assert held(journal).resources == (ResourceEntry("hook", "FREE", 0, ""),)
    journal.write((ResourceEntry("hook", "USED", 1, "rm#1"),), (), 1.0, 0)


def test_it_stays_small(path: Path, journal: Journal) -> None:
    for number in range(1, 12_001):
        entries = (over(number), ManagerEntry("skill/lift", f"i{number}"))
        journal.write(entries, (record(2 * number), record(2 * number + 1)), 1.0, number)
    kept = held(journal)
    assert [each.goal_id for each in kept.goals] == [f"g{n}" for n in range(12_001 - GOALS_REMEMBERED, 12_001)]
    assert len(kept.managers) == MANAGERS_KEPT
    _, looked_at = look_into(path)
    assert [each.id for each in looked_at.records] == [f"rm#{n}" for n in range(24_002 - HISTORY_KEPT, 24_002)]
    with closing(sqlite3.connect(path)) as reader:
        (rows_kept,) = reader.execute("SELECT count(*) FROM history").fetchone()
    assert 2 * rows_kept <= HISTORY_KEPT + TRIM_EVERY
    assert path.stat().st_size < 2 * ROOM


def test_threads_that_cannot_start_break_no_step(path: Path, journal: Journal, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(thread: threading.Thread) -> None:
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr(threading.Thread, "start", fail)
    for number in range(2 * WRITES_BETWEEN):
        journal.write((ResourceEntry("hook", "TAKEN", number, f"rm#{number}"),), (), 1.0, number)
    journal.close()
    assert held(Journal(path, ME)).step == 2 * WRITES_BETWEEN - 1


def test_an_earlier_hold_does_not_rename_the_steps_of_a_later_one(path: Path, journal: Journal) -> None:
    later = Journal(path, ME)
    later.begin_epoch("later")
    with pytest.raises(JournalTakenError):
        journal.begin_epoch("earlier")
    assert held(later).epoch == "later"


FULL_DISK = """
import resource, signal, sys
from pathlib import Path
from skillwing.services.core.snapshot import ResourceEntry
from skillwing.services.journal.journal import Journal
from skillwing.services.journal.schema import Identity
from skillwing.services.protocol import Record, RecordKind

path = Path(sys.argv[1])
journal = Journal(path, Identity("r1", "crane", "0"))
record = Record(id="rm#1", t=0.0, source="rm", kind=RecordKind.RESOURCE, subject="hook", before="", after="")
journal.write((ResourceEntry("hook", "FREE", 0, ""),), (), 0.0, 0)
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
room = max(file.stat().st_size for file in path.parent.iterdir())
resource.setrlimit(resource.RLIMIT_FSIZE, (room, room))
for step in range(1, 4001):
    journal.write((ResourceEntry("hook", str(step), step, "rm#1"),), (record,) * 6, float(step), step)
"""


def test_a_disk_that_fills_up_after_the_start_does_no_harm(path: Path) -> None:
    """No file may grow any more, and steps come without a pause."""
    subprocess.run([sys.executable, "-c", FULL_DISK, str(path)], check=True)
    assert held(Journal(path, Identity("r1", "crane", "0"))).step == 4000


def test_refusals_push_no_verdict_on_a_grant_out(journal: Journal) -> None:
    """A tree that starts a skill which is not ready asks again many times a second."""
    journal.write([over(number) for number in range(1, 11)], (), 1.0, 0)
    refused = [msgspec.structs.replace(over(0).verdict, goal_id=f"r{number}") for number in range(5000)]
    journal.write([FinishedGoal(each.goal_id, "lift", NO_TOKEN, each) for each in refused], (), 1.0, 0)
    kept = held(journal).goals
    assert [each.goal_id for each in kept if each.token] == [f"g{number}" for number in range(1, 11)]
    assert GOALS_REMEMBERED <= len(kept) - 10 < GOALS_REMEMBERED + TRIM_EVERY
    ledger = Ledger(lambda entry: None, finished=kept)
    for each in refused:
        ledger.remember(FinishedGoal(f"again {each.goal_id}", "lift", NO_TOKEN, each))
    assert ledger.finished("g1") == over(1)
    assert ledger.finished("r4999") is None


def test_a_full_disk_is_an_error_and_costs_nothing(path: Path, journal: Journal) -> None:
    journal.write((opened(1),), (), 1.0, 0)
    (pages,) = journal._connection.execute("PRAGMA page_count").fetchone()  # pyright: ignore[reportPrivateUsage]
    journal._connection.execute(f"PRAGMA max_page_count = {pages}")  # pyright: ignore[reportPrivateUsage]
    before = held(journal)
    huge = GrantEntry("lift", {"load": "x" * (2 * ROOM)}, "skill/lift", "a", opened(2).granted)
    with pytest.raises(JournalWriteError, match=r"cannot be written: database or disk is full\. Make room"):
        journal.write((huge,), (), 2.0, 0)
    assert held(journal) == before
    journal.write((opened(3),), (), 3.0, 0)
    assert held(journal).grants == (opened(1), opened(3))


# --- refusals --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("other", "sentence"),
    [
        (Identity("r2", "crane", ME.schema), r"is that of the robot `r1`, and this one is `r2`\. Name another file"),
        (Identity("r1", "winch", ME.schema), r"is that of the skillset `crane`, and this one is `winch`\. Name"),
        (Identity("r1", "crane", "f" * 16), rf"version {ME.schema} of .* this is version f+\. Go on with the skillset"),
    ],
)
def test_a_foreign_journal_is_refused(path: Path, journal: Journal, other: Identity, sentence: str) -> None:
    journal.close()
    before = path.read_bytes()
    with pytest.raises(JournalRefusedError, match=sentence):
        Journal(path, other)
    assert path.read_bytes() == before


@pytest.mark.parametrize(("step", "words"), [(1, "a newer Skillwing"), (-1, "an older Skillwing")])
def test_a_journal_of_another_format_is_refused(path: Path, journal: Journal, step: int, words: str) -> None:
    journal.close()
    with closing(sqlite3.connect(path)) as other:
        other.execute(f"PRAGMA user_version = {FORMAT + step}")
    sentence = f"by {words}: its format is {FORMAT + step}, this one reads {FORMAT}. "
    with pytest.raises(JournalRefusedError, match=re.escape(sentence)):
        Journal(path, ME)


@pytest.mark.parametrize("content", [b"no database at all\n" * 100, b"\xff" * 8192])
def test_a_file_that_is_no_database_is_refused_and_left_alone(path: Path, content: bytes) -> None:
    path.write_bytes(content)
    with pytest.raises(JournalRefusedError, match=r"is damaged: file is not a database\. Move it away"):
        Journal(path, ME)
    assert path.read_bytes() == content


def test_another_database_is_refused(path: Path) -> None:
    with closing(sqlite3.connect(path)) as other:
        other.execute("CREATE TABLE songs (title TEXT)")
    with pytest.raises(JournalRefusedError, match="is no journal of a resource manager"):
        Journal(path, ME)


def test_pages_overwritten_by_something_else_are_noticed(path: Path, journal: Journal) -> None:
    journal.write([over(number) for number in range(200)], [record(number) for number in range(200)], 1.0, 0)
    journal.close()
    content = bytearray(path.read_bytes())
    for page in range(1, len(content) // 4096):
        content[page * 4096 : page * 4096 + 64] = b"\x5a" * 64
    path.write_bytes(content)
    with pytest.raises(JournalRefusedError, match=r"is damaged: [^*]"):
        Journal(path, ME)


def test_values_that_were_never_written_are_noticed(path: Path, journal: Journal) -> None:
    journal.write((opened(1),), (), 1.0, 0)
    journal.close()
    with closing(sqlite3.connect(path)) as meddler:
        meddler.execute("UPDATE grants SET granted = '{}'")
        meddler.commit()
    with pytest.raises(JournalRefusedError, match="is damaged: Object missing"):
        Journal(path, ME).snapshot()


def test_a_directory_that_nobody_can_write_to_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(JournalWriteError, match=r"cannot be written: unable to open database file\. Make room"):
        Journal(tmp_path / "nowhere" / "journal.sqlite", ME)


def test_a_journal_that_somebody_has_locked_may_be_tried_again(
    path: Path, journal: Journal, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An SQLite shell, a backup: it says nothing about the journal, be it in the way of a writer or of a reader."""
    monkeypatch.setattr("skillwing.services.journal.journal.PATIENCE", 0.01)
    with closing(sqlite3.connect(path, isolation_level=None)) as shell:
        shell.execute("BEGIN IMMEDIATE")
        with pytest.raises(JournalWriteError, match="database is locked"):
            Journal(path, ME)
    journal.close()
    with closing(sqlite3.connect(path, isolation_level=None)) as shell:
        shell.execute("PRAGMA locking_mode = EXCLUSIVE")
        shell.execute("BEGIN EXCLUSIVE")
        with pytest.raises(JournalUnreadableError, match=r"cannot be read now: database is locked\. See who else"):
            Journal(path, ME)
    assert held(Journal(path, ME)).grants == ()


# --- looking, and setting aside --------------------------------------------------------------------------------------


def test_it_can_be_read_while_it_is_written(path: Path, journal: Journal) -> None:
    journal.write((opened(1),), (), 1.0, 0)
    identity, kept = look_into(path)
    assert (identity, kept.grants) == (ME, (opened(1),))
    journal.write((opened(2),), (), 1.0, 0)


def test_there_may_be_nothing_to_look_into(path: Path) -> None:
    with pytest.raises(NoJournalError, match="There is no journal at"):
        look_into(path)
    Journal(path, ME).close()
    with pytest.raises(NoJournalError, match="Nothing has been written"):
        look_into(path)


def test_a_journal_that_is_set_aside_is_whole_and_never_overwritten(path: Path, journal: Journal) -> None:
    journal.write((opened(1),), (), 1.0, 0)
    journal.close()
    assert set_aside(path) == path.with_name("journal-1.sqlite")
    assert set_aside(path) is None
    second = Journal(path, ME)
    second.write((), (), 0.0, 0)
    second.close()
    assert set_aside(path) == path.with_name("journal-2.sqlite")
    assert look_into(path.with_name("journal-1.sqlite"))[1].grants == (opened(1),)


def test_a_heading_says_nothing_about_a_damage(path: Path) -> None:
    assert "is damaged: Tree 2 page 3: unused. Move" in str(
        damaged(path, "*** in database main ***\nTree 2 page 3: unused")
    )
    assert "is damaged: *** in database main ***. Move" in str(damaged(path, "*** in database main ***"))


def test_a_journal_that_cannot_be_set_aside_is_an_error_with_a_sentence(
    path: Path, journal: Journal, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> Path:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "rename", refuse)
    with pytest.raises(JournalWriteError, match=r"cannot be written: .*Permission denied"):
        journal.set_aside()
