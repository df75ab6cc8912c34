"""Reports of all missions of a run, and which of them still need one."""

from __future__ import annotations

import fcntl
import math
from collections.abc import Sequence
from pathlib import Path

from msgspec import DecodeError
from msgspec.structs import replace as replaced

from skillwing.dsl import load
from skillwing.services.history.history import History
from skillwing.services.history.mission_intervals import MissionInterval, mission_intervals, read_phases
from skillwing.services.history.report import REPORT_FILE, RESULTS, MissionReport, OperatorFacts, read_report
from skillwing.services.history.wording import time_text
from skillwing.services.names import MISSION
from skillwing.services.options import imported
from skillwing.services.protocol import MissionPhase, MissionStatus, Record, RecordKind
from skillwing.services.recording.run_facts import RUN_FILE, RunFacts, version_note
from skillwing.services.report.mission_report import ReportedMission, read_history, report_mission

ROUNDED_OFF = 0.00049
"""Most by which a time in a report, in whole milliseconds, may be before the true one, in seconds."""

SEEN_WITHIN = 1.0
"""Most robot seconds between the record of a mission's begin and its first status."""


def write_reports(
    run: Path, facts: RunFacts, known: OperatorFacts | None, *, only_last: bool = False, until: float = math.inf
) -> list[tuple[Path, MissionReport]]:
    """Report the missions of a run that had begun by `until`, in robot time; returns each folder and report.

    known: facts about the last mission. With them, only that mission is reported, and others without a report.
    Facts about the other missions come from their earlier reports, also the end of one that was not recorded. Raises
    OSError, InvalidOptionError, and SkillsetError for a skillset file that has gone.

    One process at a time writes reports of a run. The next one keeps the facts in them.
    """
    with (run / RUN_FILE).open("rb") as locked:
        fcntl.flock(locked, fcntl.LOCK_EX)
        return _write_reports(run, facts, known, only_last=only_last, until=until)


def _write_reports(
    run: Path, facts: RunFacts, known: OperatorFacts | None, *, only_last: bool, until: float
) -> list[tuple[Path, MissionReport]]:
    skillset = load(facts.skillset)
    note = version_note(facts, skillset)
    judge = None if facts.judge is None else imported({"judge": facts.judge}, "judge")
    alone = facts.mission is not None
    phases = read_phases(run)

    def missions_begun() -> list[MissionInterval]:
        return [each for each in mission_intervals(phases.records) if each.begin <= until]

    def folder_of(mission: MissionInterval) -> Path:
        return run if alone else run / mission.name

    missions = missions_begun()
    seen = {each.number: _earlier_facts(folder_of(each), 0.0 if alone else each.begin) for each in missions}
    if missions and known is not None:
        seen[missions[-1].number] = _timed(known, missions[-1])
    for each in missions:
        _add_lost_end(phases, each, seen[each.number].end)
    missions = missions_begun()
    due = missions[-1:] if only_last else missions if known is None else _unreported(run, missions)
    written: list[tuple[Path, MissionReport]] = []
    for each in due:
        begin, end = (0.0, math.inf) if alone else (each.begin, math.inf if each.end is None else each.end)
        history = read_history(run, skillset, begin, end)
        for record in phases.records:
            history.add_record(record)
        reported = ReportedMission(
            mission=each.mission,
            run_dir=run,
            folder=folder_of(each),
            begin=begin,
            end=end,
            options=facts.options,
            phases=each.records,
            wall_time_s=seen[each.number].wall_time_s,
            processes=seen[each.number].processes,
            notes=(*([] if alone else [_time_note(each)]), *([] if note is None else [note])),
        )
        written.append((reported.folder, report_mission(reported, skillset, judge, history)))
    return written


def _timed(known: OperatorFacts, mission: MissionInterval) -> OperatorFacts:
    """The facts, without a wall time that does not count from the begin of the mission: it was seen late, or it is of
    the mission before."""
    if known.begun is not None and abs(known.begun - mission.begin) <= SEEN_WITHIN:
        return known
    return replaced(known, wall_time_s=None)


def _unreported(run: Path, missions: Sequence[MissionInterval]) -> list[MissionInterval]:
    """The last mission, and those without a report: their process was killed, and the next one came soon."""
    return [each for each in missions if each is missions[-1] or not (run / each.name / REPORT_FILE).exists()]


def _add_lost_end(history: History, mission: MissionInterval, end: MissionStatus | None) -> None:
    """Add a record of the mission's end if none is recorded: the recorder was down then."""
    if mission.phase is not None or end is None or end.mission != mission.mission:
        return
    record = Record(
        id=f"{MISSION}-end#{mission.number}",
        t=end.t,
        source=MISSION,
        kind=RecordKind.MISSION,
        subject=end.mission,
        before=MissionPhase.RUNNING,
        after=end.phase,
        text=end.text,
    )
    history.add_record(record)


def _earlier_facts(folder: Path, begin: float) -> OperatorFacts:
    """The facts of an earlier report that the files of the run may not hold. begin: its zero of time."""
    try:
        earlier = read_report(folder)
    except (FileNotFoundError, DecodeError):  # one of another version, or damaged, has nothing to tell
        return OperatorFacts()
    phase = next((MissionPhase(phase) for phase, result in RESULTS.items() if result == earlier.result), None)
    end = begin + earlier.sim_time_s + ROUNDED_OFF
    status = None if phase is None else MissionStatus(mission=earlier.mission, phase=phase, t=end, text="")
    return OperatorFacts(wall_time_s=earlier.wall_time_s, processes=earlier.processes, end=status)


def _time_note(mission: MissionInterval) -> str:
    return f"Times count from the beginning of the mission, at {time_text(mission.begin)} of robot time."
