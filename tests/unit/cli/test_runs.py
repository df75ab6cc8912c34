"""Runs in a folder: what is listed, and what is deleted."""

from __future__ import annotations

import errno
import json
import os
import time
from datetime import datetime
from pathlib import Path

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st
from typer.testing import CliRunner

from skillwing.services.commands.runs import runs as command
from skillwing.services.core.snapshot import ResourceEntry
from skillwing.services.history.files import MISSIONS_FILE, TIMELINE_FILE, JsonLines
from skillwing.services.history.recording_state import RecordingState, StateFile
from skillwing.services.journal.journal import Journal
from skillwing.services.journal.schema import Identity
from skillwing.services.names import JOURNAL_FILE
from skillwing.services.protocol import Record, RecordKind
from skillwing.services.recording.recording_lock import RecordingLock, is_recorded
from skillwing.services.recording.run_facts import RUN_FILE, RunFacts, write_facts
from skillwing.services.runs.pruning import RunLimits, runs_to_delete
from skillwing.services.runs.runs import DAMAGED, MissionEnd, Run, find_runs
from skillwing.services.sizes import read_age, read_size, size_text, size_words
from skillwing.services.terminal.run_directory import claimed

RUNS = st.lists(
    st.builds(
        Run,
        path=st.text(min_size=1),
        robot=st.just("m600"),
        begun=st.integers(0, 100).map(float),
        seconds=st.none(),
        size=st.integers(0, 50),
        active=st.booleans(),
    ),
    unique_by=lambda run: run.path,
).map(lambda runs: sorted(runs, key=lambda run: run.begun))


@given(RUNS, st.none() | st.integers(0, 300), st.none() | st.integers(0, 5), st.none() | st.integers(0, 100))
def test_what_stays_is_within_the_limits_or_active(
    runs: list[Run], size: int | None, count: int | None, oldest: int | None
) -> None:
    gone = runs_to_delete(runs, RunLimits(size=size, count=count, oldest=oldest))
    stay = [run for run in runs if run not in gone]
    free = [run for run in stay if not run.active]
    assert not any(run.active for run in gone)
    assert size is None or sum(run.size for run in stay) <= size or not free
    assert count is None or len(stay) <= count or not free
    assert oldest is None or all(run.begun >= oldest for run in free)
    if oldest is None:
        assert all(one.begun <= other.begun for one in gone for other in free), "the oldest go first"
    if size is count is oldest is None:
        assert gone == []


def phase(t: float, after: str, before: str = "IDLE") -> Record:
    return Record(
        id=f"m#{t}", t=t, source="mission", kind=RecordKind.MISSION, subject="patrol", before=before, after=after
    )


def make_run(path: Path, begun: float, *phases: Record) -> Path:
    write_facts(path, RunFacts(robot="rover", skillset="none.skillset"))
    for name in (TIMELINE_FILE, MISSIONS_FILE):
        with JsonLines[Record](path / name) as file:
            for each in phases:
                file.write(each)
    (path / RUN_FILE).write_bytes(msgspec.json.encode(RunFacts(robot="rover", skillset="none.skillset", begun=begun)))
    return path


def test_a_run_is_listed_with_its_length_missions_and_what_is_missing(tmp_path: Path) -> None:
    make_run(
        tmp_path / "runs" / "b",
        200.0,
        phase(10.0, "RUNNING"),
        phase(40.0, "SUCCEEDED", "RUNNING"),
        phase(50.0, "RUNNING"),
        phase(60.0, "FAILED", "RUNNING"),
        phase(70.0, "RUNNING"),
    )
    make_run(tmp_path / "runs" / "a", 100.0)
    (tmp_path / "runs" / "pictures").mkdir()
    (tmp_path / "elsewhere").mkdir()
    make_run(tmp_path / "elsewhere" / "c", 300.0)
    (tmp_path / "runs" / "link").symlink_to(tmp_path / "elsewhere" / "c")
    StateFile(tmp_path / "runs" / "b").write(RecordingState(keep=100).with_deleted(TIMELINE_FILE, 5000, 9.0))
    first, second = find_runs(tmp_path / "runs", {(tmp_path / "runs" / "a").resolve()})
    assert (Path(first.path).name, first.seconds, first.active, first.missions) == ("a", None, True, ())
    assert (Path(second.path).name, second.seconds, second.robot, second.active) == ("b", 60.0, "rover", False)
    assert second.missions == tuple(
        MissionEnd(mission="patrol", result=result) for result in ("success", "failure", "unfinished")
    )
    assert second.missing == (
        "What was recorded until 9.00 s was deleted to keep the run below 100 B: 1 part of timeline.jsonl (5 kB).",
    )
    assert second.size >= 16 << 10


def test_a_run_without_a_recording_is_found_by_its_journal(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "runs" / "unrecorded"
    folder.mkdir(parents=True)
    journal = Journal(folder / JOURNAL_FILE, Identity("rover", "digger", "0"))
    journal.write((ResourceEntry("arm", "FREE", 0, ""),), (), 0.0, 0)
    journal.close()
    (folder / "logs").mkdir()
    (folder / "logs" / "router.log").touch()
    os.utime(folder / "logs" / "router.log", (100.0, 100.0))
    make_run(tmp_path / "runs" / "later", 200.0)
    (tmp_path / "runs" / "damaged").mkdir()
    (tmp_path / "runs" / "damaged" / JOURNAL_FILE).write_bytes(b"no journal")
    found = {Path(run.path).name: run for run in find_runs(tmp_path / "runs")}
    assert (found["unrecorded"].begun, found["unrecorded"].robot, found["damaged"].robot) == (100.0, "rover", "")
    assert found["unrecorded"].size > 0
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "runtime"))
    assert run_cli("prune", "--count", "2")[0] == 0
    assert not folder.exists()


def test_a_copy_of_a_run_begins_when_the_run_began(tmp_path: Path) -> None:
    before = time.time()
    write_facts(tmp_path / "20200101-120000-up", RunFacts(robot="rover", skillset="none.skillset"))
    os.utime(tmp_path / "20200101-120000-up" / RUN_FILE, (0.0, 0.0))
    (only,) = find_runs(tmp_path)
    assert before <= only.begun <= time.time()
    assert only.missing == ()


@pytest.mark.parametrize(("name", "begun"), [("20200101-120000-up", "2020-01-01 12:00"), ("other", "2033-05-18")])
def test_a_run_of_an_earlier_version_begins_at_the_time_in_its_name_or_that_of_its_file(
    tmp_path: Path, name: str, begun: str
) -> None:
    make_run(tmp_path / name, 0.0)
    (tmp_path / name / RUN_FILE).write_bytes(b'{"robot": "rover", "skillset": "none.skillset"}')
    os.utime(tmp_path / name / RUN_FILE, (2e9, 2e9))
    (only,) = find_runs(tmp_path)
    assert datetime.fromtimestamp(only.begun).astimezone().isoformat(sep=" ").startswith(begun)


def test_a_run_with_damaged_facts_is_listed_with_the_damage(tmp_path: Path) -> None:
    run = make_run(tmp_path / "20200101-120000-up", 2e9)
    (run / RUN_FILE).write_bytes(b'{"robot": "ro')
    (only,) = find_runs(tmp_path)
    assert (only.robot, only.missing) == ("", (DAMAGED,))
    assert datetime.fromtimestamp(only.begun).astimezone().year == 2020


def run_cli(*words: str) -> tuple[int, str]:
    result = CliRunner().invoke(command, words)
    return result.exit_code, result.output


def test_a_run_in_which_a_system_starts_is_not_deleted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The system may not be announced yet, or belong to another user or session."""
    folder = make_run(tmp_path / "runs" / "a", 100.0)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "runtime"))
    with claimed(folder):
        assert run_cli("prune", "--count", "0")[0] == 0
        assert folder.exists()
    assert run_cli("prune", "--count", "0")[0] == 0
    assert not folder.exists()


def test_runs_are_deleted_by_number_but_not_one_that_is_recorded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "runtime"))
    folders = [make_run(tmp_path / "runs" / name, begun) for begun, name in enumerate("abcd", 1)]
    StateFile(folders[0]).write(RecordingState())
    lock = RecordingLock(folders[0])
    lock.hold()
    assert is_recorded(folders[0])
    assert not is_recorded(folders[1])
    code, out = run_cli("prune", "--count", "1", "--dry-run")
    assert (code, out.splitlines()[-1].partition(",")[0]) == (0, "3 runs would be deleted")
    assert all(folder.exists() for folder in folders)
    code, out = run_cli("prune", "--count", "1", "--json")
    assert (code, [run["path"] for run in json.loads(out)["runs"]]) == (0, ["runs/b", "runs/c", "runs/d"])
    assert [path.name for path in (tmp_path / "runs").iterdir()] == ["a"]
    lock.release()
    assert run_cli("prune", "--older-than", "1d")[0] == 0
    assert not folders[0].exists()


def test_a_run_that_cannot_be_deleted_stays_a_run_and_keeps_no_other_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "runtime"))
    folders = [make_run(tmp_path / "runs" / name, begun, phase(1.0, "RUNNING")) for begun, name in enumerate("ab", 1)]
    unlink = Path.unlink

    def refused(path: Path) -> None:
        if path == Path("runs/a") / TIMELINE_FILE:
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
        unlink(path)

    monkeypatch.setattr(Path, "unlink", refused)
    result = CliRunner().invoke(command, ["prune", "--count", "0"])
    assert str(result.exception) == "`runs/a` cannot be deleted: Permission denied. Check its owner."
    assert result.output.splitlines()[-1].startswith("1 run deleted")
    assert not folders[1].exists()
    assert [Path(run.path).name for run in find_runs(tmp_path / "runs")] == ["a"]


def test_without_a_limit_nothing_is_deleted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    folder = make_run(tmp_path / "runs" / "a", 1.0)
    result = CliRunner().invoke(command, ["prune"])
    assert "Give --keep SIZE, --older-than AGE or --count N." in str(result.exception)
    assert folder.exists()
    assert run_cli("prune", "--keep", "ten")[0] == 2


@pytest.mark.parametrize(("text", "size"), [("10GB", 10**10), ("1.5 MB", 1_500_000), ("3kb", 3000), ("7B", 7)])
def test_sizes_are_read(text: str, size: int) -> None:
    assert read_size(text) == size
    assert read_size(size_words(size)) == size


@pytest.mark.parametrize("text", ["", "10", "GB", "-1GB", "1 GiB", "1e3MB"])
def test_what_is_no_size_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="such as 10GB"):
        read_size(text)


def test_ages_and_sizes_have_words() -> None:
    assert [read_age(text) for text in ("30d", "12h", "2w")] == [30 * 86400, 12 * 3600, 14 * 86400]
    with pytest.raises(ValueError, match="such as 30d"):
        read_age("5 minutes")
    assert [size_text(size) for size in (0, 999, 1500, 16_000_000, 10**10, 123_456_789)] == [
        "0 B",
        "999 B",
        "1.5 kB",
        "16 MB",
        "10 GB",
        "123 MB",
    ]
