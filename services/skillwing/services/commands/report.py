"""`skillwing report`: report and pictures of the missions of a run, from the run's files."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import msgspec
import typer

from skillwing.dsl import load
from skillwing.services.errors import InvalidOptionError, SkillwingError
from skillwing.services.history.report import REPORT_FILE, Report, Witnessed, read_report, summary_table
from skillwing.services.options import imported
from skillwing.services.recording.run_facts import RunFacts, other_version, read_facts
from skillwing.services.report.run_reports import Flight, flights_of
from skillwing.services.terminal.connection import JsonOption
from skillwing.services.terminal.output import make_console, print_json
from skillwing.services.terminal.records import time_text

NEITHER = "No mission was flown in this run. `skillwing timeline RUN` shows what was."
TABLE_WIDTH = 100


def report(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="A run's directory.", show_default=False)],
    last: Annotated[bool, typer.Option("--last", help="Only of the mission that was flown last.")] = False,
    witnessed: Annotated[Path | None, typer.Option(hidden=True)] = None,
    until: Annotated[float, typer.Option(hidden=True)] = math.inf,
    as_json: JsonOption = False,
) -> None:
    """Write the report of each mission of a run, with its pictures, and show it.

    `up` and `demo` do this by themselves when a mission ends. It is for a run that was cut short, or whose report is
    to be made anew.

    Exit codes: 0 written, 1 nothing could be written, 2 no such run, or one without a mission.
    """
    facts = read_facts(run)
    known = None if witnessed is None else msgspec.json.decode(witnessed.read_bytes(), type=Witnessed)
    try:
        written = write_reports(run.absolute(), facts, known, only_last=last, until=until)
    except OSError as error:
        raise SkillwingError(f"The report cannot be written: {error}.") from error
    if not written:
        raise InvalidOptionError("RUN", NEITHER)
    if as_json:
        print_json([{"folder": str(folder), "report": report} for folder, report in written])
        return
    console = make_console()
    for folder, each in written:
        console.print(summary_table(each), width=min(console.width, TABLE_WIDTH))
        console.print(f"Report and pictures: {folder}", soft_wrap=True)


def write_reports(
    run: Path, facts: RunFacts, known: Witnessed | None, *, only_last: bool = False, until: float = math.inf
) -> list[tuple[Path, Report]]:
    """Report the missions of a run that had begun by `until`, in robot time; returns where, and what.

    known: of the last one, which is reported then, and of the others those that have no report yet. What was witnessed
    of any other mission is what an earlier report says. Raises OSError and InvalidOptionError, and SkillsetError for a
    skillset that is not there any more.
    """
    try:
        from skillwing.services.report.mission_report import (  # noqa: PLC0415 - drawing is optional
            FlownMission,
            read_history,
            report_flight,
        )
    except ModuleNotFoundError as missing:
        text = f"{missing.name} is not installed. To draw a run: pip install 'skillwing[viewer]'."
        raise InvalidOptionError("RUN", text) from missing
    skillset = load(facts.skillset)
    remark = other_version(facts, skillset)
    judge = None if facts.judge is None else imported({"judge": facts.judge}, "judge")
    history = read_history(run, skillset)
    flights = [flight for flight in flights_of(history.records) if flight.begin <= until]
    due = flights[-1:] if only_last else flights if known is None else _unreported(run, flights)
    written: list[tuple[Path, Report]] = []
    for flight in due:
        alone = facts.mission is not None
        folder = run if alone else run / flight.name
        seen = known if flight is flights[-1] and known is not None else _seen_before(folder)
        flown = FlownMission(
            mission=flight.mission,
            run_dir=run,
            folder=folder,
            begin=0.0 if alone else flight.begin,
            end=float("inf") if alone or flight.end is None else flight.end,
            options=facts.options,
            wall_time_s=seen.wall_time_s,
            processes=seen.processes,
            notes=(*([] if alone else [_times(flight)]), *([] if remark is None else [remark])),
        )
        written.append((flown.folder, report_flight(flown, skillset, judge, history)))
    return written


def _unreported(run: Path, flights: Sequence[Flight]) -> list[Flight]:
    """The last one, and those whose end nobody has told: their process was killed, and the next one came soon."""
    return [each for each in flights if each is flights[-1] or not (run / each.name / REPORT_FILE).exists()]


def _seen_before(folder: Path) -> Witnessed:
    """What an earlier report of a mission knew that its files do not tell."""
    if not (folder / REPORT_FILE).exists():
        return Witnessed()
    earlier = read_report(folder)
    return Witnessed(wall_time_s=earlier.wall_time_s, processes=earlier.processes)


def _times(flight: Flight) -> str:
    return f"Times count from the beginning of the mission, which was at {time_text(flight.begin)} of robot time."
