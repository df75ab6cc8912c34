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
from skillwing.services.history.files import read_goals, read_records
from skillwing.services.history.history import History
from skillwing.services.history.report import JudgedFigure, MissionReport, ProcessEntry, make_report
from skillwing.services.report.rendering import write_report
from skillwing.services.report.timeline_picture import MISSION_TIME, ROBOT_TIME, draw_timeline
from skillwing.services.robot import RECORDER

TIMELINE_PICTURE = "timeline.png"
UNRECORDED = "The recorder died: the record is incomplete from then on."


@dataclass(frozen=True, kw_only=True)
class ReportedMission:
    """A mission to be reported. run_dir: directory with the recorder's files. folder: for report and pictures.

    begin, end: of the mission in the run's robot time. options: of the run (`seed`, `world`, ...). wall_time_s,
    processes: facts of the command that ran it. notes: sentences for readers of `report.md`.
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


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """Verdict of a robot's judge on a mission. notes: sentences on the origin of the figures."""

    figures: tuple[JudgedFigure, ...] = ()
    notes: tuple[str, ...] = ()


Judge: TypeAlias = Callable[[ReportedMission, History, str], Verdict]
"""Judge of a mission. Arguments: the mission, its history from the begin on, a title for pictures in the folder."""


def read_history(run_dir: Path, skillset: Skillset) -> History:
    """The history in the recorder's files."""
    return History.of(read_records(run_dir), read_goals(run_dir), skillset)


def report_mission(
    reported: ReportedMission, skillset: Skillset, judge: Judge | None = None, history: History | None = None
) -> MissionReport:
    """Write `report.json`, `report.md` and `timeline.png`, with the judge's verdict.

    history: of the whole run; without it, it is read. Raises OSError for a folder that is not writable.
    """
    history = history or read_history(reported.run_dir, skillset)
    if reported.begin > 0.0 or reported.end < math.inf:
        history = history.part(reported.begin, reported.end)
    seed = reported.options.get("seed")
    report = make_report(
        history, mission=reported.mission, seed=seed, wall_time_s=reported.wall_time_s, processes=reported.processes
    )
    title = f"{reported.mission}: {report.result} at {report.sim_time_s:.0f} s" + (
        "" if seed is None else f", seed {seed}"
    )
    reported.folder.mkdir(parents=True, exist_ok=True)
    verdict = judge(reported, history, title) if judge is not None else Verdict()
    report = replaced(report, judged=verdict.figures)
    write_report(report, history, reported.folder, [*reported.notes, *_warnings(reported.processes), *verdict.notes])
    clock = MISSION_TIME if reported.begin > 0.0 else ROBOT_TIME
    draw_timeline(history, reported.folder / TIMELINE_PICTURE, title=title, resources=skillset.resources, clock=clock)
    return report


def _warnings(processes: Sequence[ProcessEntry]) -> list[str]:
    lost = any(process.name == RECORDER and process.state == "died" for process in processes)
    return [f"**{UNRECORDED}**"] if lost else []
