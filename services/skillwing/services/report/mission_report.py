"""What a flight leaves behind when it is over: report and pictures, made from the files of its run.

The same for whoever ran it: `demo` and campaigns, which fly one mission, and `up`, in which missions come and go. What
only the robot's own judge can say, such as whether it hit anything, that judge is asked.
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
from skillwing.services.history.report import Coverage, ProcessEntry, Report, make_report, write_report
from skillwing.services.report.timeline_picture import MISSION_TIME, ROBOT_TIME, draw_timeline
from skillwing.services.robot import RECORDER

TIMELINE_PICTURE = "timeline.png"
UNRECORDED = "The recorder died: what happened after that is known in part only, or not at all."


@dataclass(frozen=True, kw_only=True)
class FlownMission:
    """A flight to be reported. run_dir: with the recorder's files; folder: where report and pictures go.

    begin, end: of the flight in the run's robot time. options: those of the run (`seed`, `world`, ...). wall_time_s,
    processes, notes: what only the one who ran it knows; notes are sentences for readers of `report.md`.
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
    """What a robot's judge says of a flight; None for what cannot be known. notes: how that was found."""

    collisions: int | None = None
    min_clearance_m: float | None = None
    coverage: Coverage = field(default_factory=Coverage)
    notes: tuple[str, ...] = ()


Judge: TypeAlias = Callable[[FlownMission, History, str], Verdict]
"""Called with the flight, its history since its beginning, and a title for pictures, which go into the folder."""


def read_history(run_dir: Path, skillset: Skillset) -> History:
    """The history that the recorder's journal tells."""
    return History.of(read_records(run_dir), read_goals(run_dir), skillset)


def report_flight(
    flown: FlownMission, skillset: Skillset, judge: Judge | None = None, history: History | None = None
) -> Report:
    """Write `report.json`, `report.md` and `timeline.png`, and have the judge add what it has to say.

    history: of the whole run, which is read otherwise. Raises OSError where nothing can be written.
    """
    history = history or read_history(flown.run_dir, skillset)
    if flown.begin > 0.0 or flown.end < math.inf:
        history = history.part(flown.begin, flown.end)
    seed = flown.options.get("seed")
    report = make_report(
        history, mission=flown.mission, seed=seed, wall_time_s=flown.wall_time_s, processes=flown.processes
    )
    title = f"{flown.mission}: {report.result} at {report.sim_time_s:.0f} s" + (
        "" if seed is None else f", seed {seed}"
    )
    flown.folder.mkdir(parents=True, exist_ok=True)
    verdict = judge(flown, history, title) if judge is not None else Verdict()
    report = replaced(
        report,
        collisions=verdict.collisions,
        min_clearance_m=None if verdict.min_clearance_m is None else round(verdict.min_clearance_m, 3),
        coverage=verdict.coverage,
    )
    write_report(report, history, flown.folder, [*flown.notes, *_warnings(flown.processes), *verdict.notes])
    clock = MISSION_TIME if flown.begin > 0.0 else ROBOT_TIME
    draw_timeline(history, flown.folder / TIMELINE_PICTURE, title=title, resources=skillset.resources, clock=clock)
    return report


def _warnings(processes: Sequence[ProcessEntry]) -> list[str]:
    lost = any(process.name == RECORDER and process.state == "died" for process in processes)
    return [f"**{UNRECORDED}**"] if lost else []
