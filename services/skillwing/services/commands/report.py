"""`skillwing report`: the reports of a run's missions, written again or for the first time."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import msgspec
import typer

from skillwing.services.errors import InvalidOptionError, SkillwingError
from skillwing.services.history.report import OperatorFacts
from skillwing.services.recording.run_facts import read_facts
from skillwing.services.terminal.connection import JsonOption
from skillwing.services.terminal.output import make_console, print_json
from skillwing.services.viewer_extra import viewer_module

NO_MISSION = "No mission ran in this run. `skillwing timeline RUN` shows what was."
TABLE_WIDTH = 100


def report(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="A run's directory.", show_default=False)],
    last: Annotated[bool, typer.Option("--last", help="Only of the mission that ran last.")] = False,
    facts: Annotated[Path | None, typer.Option(hidden=True)] = None,
    until: Annotated[float, typer.Option(hidden=True)] = math.inf,
    brief: Annotated[bool, typer.Option("--brief", hidden=True)] = False,
    as_json: JsonOption = False,
) -> None:
    """Write and show the report of each mission of a run, with its pictures.

    `up` and `demo` do this when a mission ends. Use it for a run that was cut short, or to write a report again.
    See docs/recordings.md.

    Exit codes: 0 written, 1 nothing could be written, 2 no such run, or one without a mission.
    """
    run_facts = read_facts(run)
    known = None if facts is None else msgspec.json.decode(facts.read_bytes(), type=OperatorFacts)
    reports = viewer_module("skillwing.services.report.run_reports", "RUN")
    rendering = viewer_module("skillwing.services.report.rendering", "RUN")
    try:
        written = reports.write_reports(run.absolute(), run_facts, known, only_last=last, until=until)
    except OSError as error:
        raise SkillwingError(f"The report cannot be written: {error}.") from error
    if not written:
        raise InvalidOptionError("RUN", NO_MISSION)
    if brief:
        print_json(
            [{"folder": str(folder), "mission": each.mission, "result": each.result} for folder, each in written]
        )
        return
    if as_json:
        print_json([{"folder": str(folder), "report": report} for folder, report in written])
        return
    console = make_console()
    for folder, each in written:
        console.print(rendering.summary_table(each), width=min(console.width, TABLE_WIDTH))
        console.print(f"Report and pictures: {folder}", soft_wrap=True)
