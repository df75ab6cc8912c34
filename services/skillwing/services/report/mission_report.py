"""Report and pictures of one mission, made from the files of its run.

They are the same for `demo` and campaigns, which run one mission, and for `up`, where missions come and go. Facts
that need the true world, such as collisions, come from the robot's own judge.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeAlias

from msgspec.structs import replace as replaced

from skillwing.dsl.model import Skillset
from skillwing.services.history.files import GOALS_FILE, TIMELINE_FILE, iterate
from skillwing.services.history.history import History
from skillwing.services.history.recent_history import RecentHistory
from skillwing.services.history.recording_state import missing_sentences, read_state
from skillwing.services.history.report import JudgedFigure, MissionReport, ProcessEntry, make_report
from skillwing.services.protocol import GoalStatus, Record
from skillwing.services.report.rendering import write_report
from skillwing.services.report.timeline_picture import MISSION_TIME, ROBOT_TIME, draw_timeline
from skillwing.services.robot import RECORDER

TIMELINE_PICTURE = "timeline.png"
MOST_RECORDS, MOST_GOALS = 50_000, 10_000
"""Records and goals that a report is made of: the last ones of its mission, so that its memory is bounded."""
LONGEST_CHAIN = 1_000
"""Records at which a chain of causes in a report is cut."""
UNRECORDED = "The recorder died: the record is incomplete from then on."


@dataclass(frozen=True, kw_only=True)
class ReportedMission:
    """A mission to be reported. run_dir: directory with the recorder's files. folder: for report and pictures.

    begin, end: of the mission in the run's robot time. options: of the run (`seed`, `world`, ...). wall_time_s,
    processes: facts of the command that ran it. notes: sentences for readers of `report.md`. phases: as of
    `make_report`.
    """

    mission: str
    run_dir: Path
    folder: Path
    begin: float = 0.0
    end: float = math.inf
    options: dict[str, Any] = field(default_factory=dict[str, Any])
    wall_time_s: float | None = None
    processes: tuple[ProcessEntry, ...] = ()
    notes: tuple[str, ...] = ()
    phases: frozenset[str] | None = None


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """Verdict of a robot's judge on a mission. notes: sentences on the origin of the figures."""

    figures: tuple[JudgedFigure, ...] = ()
    notes: tuple[str, ...] = ()


Judge: TypeAlias = Callable[[ReportedMission, History, str], Verdict]
"""Judge of a mission. Arguments: the mission, its history from the begin on, a title for pictures in the folder."""


def read_history(
    run_dir: Path, skillset: Skillset | None, begin: float = -math.inf, end: float = math.inf
) -> RecentHistory:
    """The history in the recorder's files until `end`, with at least the time from `begin` on. Of a long time it holds
    the last part."""
    history = RecentHistory(skillset, records=MOST_RECORDS, goals=MOST_GOALS, longest_chain=LONGEST_CHAIN)
    for record in iterate(run_dir, TIMELINE_FILE, Record, begin, end):
        if record.t <= end:
            history.add_record(record)
    for status in iterate(run_dir, GOALS_FILE, GoalStatus, begin, end):
        if status.t <= end:
            history.add_status(status)
    return history


def report_mission(
    reported: ReportedMission, skillset: Skillset, judge: Judge | None = None, history: History | None = None
) -> MissionReport:
    """Write `report.json`, `report.md` and `timeline.png`, with the judge's verdict.

    history: of at least the time of the mission; without it, it is read. Raises OSError for a folder that is not
    writable.
    """
    whole = history = history or read_history(reported.run_dir, skillset, reported.begin, reported.end)
    if reported.begin > 0.0 or reported.end < math.inf:
        history = history.part(reported.begin, reported.end)
    seed = reported.options.get("seed")
    report = make_report(
        history,
        mission=reported.mission,
        seed=seed,
        wall_time_s=reported.wall_time_s,
        processes=reported.processes,
        phases=reported.phases,
    )
    title = f"{reported.mission}: {report.result} at {report.sim_time_s:.0f} s" + (
        "" if seed is None else f", seed {seed}"
    )
    reported.folder.mkdir(parents=True, exist_ok=True)
    verdict = judge(reported, history, title) if judge is not None else Verdict()
    report = replaced(report, judged=verdict.figures, missing=tuple(_missing(reported, whole)))
    clock = MISSION_TIME if reported.begin > 0.0 else ROBOT_TIME
    draw_timeline(history, reported.folder / TIMELINE_PICTURE, title=title, resources=skillset.resources, clock=clock)
    # The report comes last: a mission without one is reported again.
    write_report(report, history, reported.folder, [*reported.notes, *_warnings(reported.processes), *verdict.notes])
    return report


def _missing(reported: ReportedMission, history: History) -> list[str]:
    """Sentences on what the report lacks: what was not recorded, was deleted, or is too much for a report."""
    sentences = missing_sentences(read_state(reported.run_dir), reported.begin, reported.end)
    forgotten = history.forgotten_until if isinstance(history, RecentHistory) else None
    if forgotten is not None and forgotten >= reported.begin:
        last = f"This report has the last {MOST_GOALS} goals and {MOST_RECORDS} records of a long mission"
        sentences.append(f"{last}. `{TIMELINE_FILE}` and `{GOALS_FILE}` have all of them.")
    return sentences


def _warnings(processes: Sequence[ProcessEntry]) -> list[str]:
    lost = any(process.name == RECORDER and process.state == "died" for process in processes)
    return [f"**{UNRECORDED}**"] if lost else []
