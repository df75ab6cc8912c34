"""Reports of all missions of a run: when each ran, and which of them still needs a report."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from skillwing.dsl import load
from skillwing.services.history.history import PHASES
from skillwing.services.history.report import REPORT_FILE, MissionReport, OperatorFacts, read_report
from skillwing.services.history.wording import time_text
from skillwing.services.options import imported
from skillwing.services.protocol import MissionPhase, Record, RecordKind
from skillwing.services.recording.run_facts import RunFacts, version_note
from skillwing.services.report.mission_report import ReportedMission, read_history, report_mission


@dataclass(frozen=True, slots=True)
class MissionInterval:
    """One mission from its begin to its end, in robot time; `end` is None without a record of the end.

    number: counts the missions of a run, from 1 on.
    """

    number: int
    mission: str
    begin: float
    end: float | None = None

    @property
    def name(self) -> str:
        return f"{self.number}-{self.mission}"


def mission_intervals(records: Iterable[Record]) -> tuple[MissionInterval, ...]:
    """The missions of a run, from its records in order of time.

    A mission that never began, because the robot was not ready, ends when it is given up. One without a record of its
    end is over just before the next one begins.
    """
    return tuple(
        _intervals(record for record in records if record.kind is RecordKind.MISSION and record.after in PHASES)
    )


def _intervals(phases: Iterable[Record]) -> Iterator[MissionInterval]:
    number, current = 0, None
    for record in phases:
        if current is not None and (record.subject != current.mission or record.before == "IDLE"):
            # Just before: this record belongs to the next mission, and may hold the end of that one.
            yield replace(current, end=max(current.begin, math.nextafter(record.t, -math.inf)))
            current = None
        if current is None:
            number += 1
            current = MissionInterval(number, record.subject, record.t)
        if MissionPhase(record.after).over:
            yield replace(current, end=record.t)
            current = None
    if current is not None:
        yield current


def write_reports(
    run: Path, facts: RunFacts, known: OperatorFacts | None, *, only_last: bool = False, until: float = math.inf
) -> list[tuple[Path, MissionReport]]:
    """Report the missions of a run that had begun by `until`, in robot time; returns each folder and report.

    known: facts about the last mission. With them, only that mission is reported, and others without a report.
    Facts about the other missions come from their earlier reports. Raises OSError, InvalidOptionError, and
    SkillsetError for a skillset file that has gone.
    """
    skillset = load(facts.skillset)
    note = version_note(facts, skillset)
    judge = None if facts.judge is None else imported({"judge": facts.judge}, "judge")
    history = read_history(run, skillset)
    missions = [each for each in mission_intervals(history.records) if each.begin <= until]
    due = missions[-1:] if only_last else missions if known is None else _unreported(run, missions)
    written: list[tuple[Path, MissionReport]] = []
    for each in due:
        alone = facts.mission is not None
        folder = run if alone else run / each.name
        seen = known if each is missions[-1] and known is not None else _earlier_facts(folder)
        reported = ReportedMission(
            mission=each.mission,
            run_dir=run,
            folder=folder,
            begin=0.0 if alone else each.begin,
            end=math.inf if alone or each.end is None else each.end,
            options=facts.options,
            wall_time_s=seen.wall_time_s,
            processes=seen.processes,
            notes=(*([] if alone else [_time_note(each)]), *([] if note is None else [note])),
        )
        written.append((reported.folder, report_mission(reported, skillset, judge, history)))
    return written


def _unreported(run: Path, missions: Sequence[MissionInterval]) -> list[MissionInterval]:
    """The last mission, and those without a report: their process was killed, and the next one came soon."""
    return [each for each in missions if each is missions[-1] or not (run / each.name / REPORT_FILE).exists()]


def _earlier_facts(folder: Path) -> OperatorFacts:
    """The facts of an earlier report that the files of the run do not hold."""
    if not (folder / REPORT_FILE).exists():
        return OperatorFacts()
    earlier = read_report(folder)
    return OperatorFacts(wall_time_s=earlier.wall_time_s, processes=earlier.processes)


def _time_note(mission: MissionInterval) -> str:
    return f"Times count from the beginning of the mission, at {time_text(mission.begin)} of robot time."
