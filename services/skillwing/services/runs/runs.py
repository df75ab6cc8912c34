"""Runs in a folder, from their files."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import suppress
from datetime import datetime
from pathlib import Path

import msgspec

from skillwing.services.disk import directory_size
from skillwing.services.errors import BadRecordingError, SkillwingError
from skillwing.services.history.files import GOALS_FILE, TIMELINE_FILE, Timed, last_time
from skillwing.services.history.mission_intervals import MissionInterval, mission_intervals, read_phases
from skillwing.services.history.parts import part_paths
from skillwing.services.history.recording_state import missing_sentences, read_state
from skillwing.services.history.report import REPORT_FILE, RESULTS, read_report
from skillwing.services.journal.journal import look_into
from skillwing.services.names import JOURNAL_FILE
from skillwing.services.recording.run_facts import RUN_FILE, RunFacts

RUNS_FOLDER = Path("runs")
"""Default folder of runs, in the current directory."""
NAMED_TIME = 15
"""Letters of the local time in the default name of a run's folder, such as `20260401-093000-up`."""
DAMAGED = f"Its file {RUN_FILE} cannot be read: its options are unknown, and it has no reports any more."


class MissionEnd(msgspec.Struct, frozen=True, kw_only=True):
    """A mission of a run. result: as in `MissionReport`."""

    mission: str
    result: str


class Run(msgspec.Struct, frozen=True, kw_only=True):
    """A run. begun: Unix time. seconds: robot time from its first record to its last; None without a recording.

    size: bytes of all its files. missing: sentences on what was deleted or not recorded. active: a system writes to it.
    """

    path: str
    robot: str
    begun: float
    seconds: float | None
    size: int
    missions: tuple[MissionEnd, ...] = ()
    missing: tuple[str, ...] = ()
    active: bool = False


def find_runs(folder: Path, active: Collection[Path] = ()) -> list[Run]:
    """The runs in a folder, oldest first: folders with the facts of a run, or as of `--no-record` with a journal alone.
    Other folders are left out, and so are links to folders elsewhere.

    active: resolved directories of the systems that run.
    """
    found = [
        read_run(path, active=path.resolve() in active)
        for path in (folder.iterdir() if folder.is_dir() else ())
        if not path.is_symlink() and any((path / name).is_file() for name in (RUN_FILE, JOURNAL_FILE))
    ]
    return sorted(found, key=lambda run: (run.begun, run.path))


def read_run(path: Path, *, active: bool = False) -> Run:
    """One run. What cannot be read counts as absent."""
    facts = _facts(path)
    damaged = [DAMAGED] if facts is None and (path / RUN_FILE).is_file() else []
    begun = _begun(path) if facts is None or facts.begun is None else facts.begun
    facts = facts or _told_by_journal(path)
    begin, end = _first_time(path), _last_time(path)
    state = read_state(path)
    return Run(
        path=str(path),
        robot=facts.robot,
        begun=begun,
        seconds=None if begin is None or end is None else max(0.0, end - begin),
        size=directory_size(path),
        missions=tuple(_missions(path, alone=facts.mission is not None)),
        missing=(*damaged, *missing_sentences(state, float("-inf"), float("inf"))),
        active=active,
    )


def _facts(path: Path) -> RunFacts | None:
    with suppress(OSError, msgspec.DecodeError):
        return msgspec.json.decode((path / RUN_FILE).read_bytes(), type=RunFacts)
    return None


def _told_by_journal(path: Path) -> RunFacts:
    with suppress(SkillwingError, OSError):
        return RunFacts(robot=look_into(path / JOURNAL_FILE)[0].robot, skillset="")
    return RunFacts(robot="", skillset="")


def _begun(path: Path) -> float:
    """Unix time of the begin of a run whose facts do not have it, by the default name of its folder.

    For another name it is that of the file with the facts. Without that it is about that of the file that was left
    alone for longest.
    """
    with suppress(ValueError):  # another name
        return datetime.strptime(path.name[:NAMED_TIME], "%Y%m%d-%H%M%S").astimezone().timestamp()
    with suppress(OSError):
        return (path / RUN_FILE).stat().st_mtime
    times: list[float] = []
    for file in path.rglob("*"):
        with suppress(OSError):  # it was deleted meanwhile
            times.append(file.stat().st_mtime)
    return min(times, default=0.0)


def _missions(path: Path, *, alone: bool) -> Iterator[MissionEnd]:
    try:
        missions = mission_intervals(read_phases(path).records)
    except (OSError, BadRecordingError):
        return
    for each in missions:
        yield MissionEnd(mission=each.mission, result=_result(path if alone else path / each.name, each))


def _result(folder: Path, mission: MissionInterval) -> str:
    """Result of a mission; its report knows an end that was not recorded."""
    if mission.phase is None and (folder / REPORT_FILE).exists():
        with suppress(OSError, msgspec.DecodeError):
            return read_report(folder).result
    return RESULTS.get(mission.phase or "", "unfinished")


def _first_time(path: Path) -> float | None:
    """Robot time of the first record that is left. The head of a later part is older than what follows it."""
    for part in part_paths(path, TIMELINE_FILE)[:1]:
        with suppress(OSError, msgspec.DecodeError), part.open("rb") as file:
            return msgspec.json.decode(file.readline(), type=Timed).t
    return None


def _last_time(path: Path) -> float | None:
    times = [last_time(part) for name in (TIMELINE_FILE, GOALS_FILE) for part in part_paths(path, name)[-1:]]
    return max((t for t in times if t is not None), default=None)
