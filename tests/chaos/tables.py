"""Results of the chaos matrix as tables of Markdown, and their place in the documentation."""

from __future__ import annotations

import os
import platform
from collections.abc import Sequence
from datetime import date

from flights_with_faults import FlightResult
from signs import Fault
from stand import IDLE, STATES, Result

from skillwing.services.terminal.doc_sections import Marks

PLACES = {part: Marks.named(f"chaos, {part}") for part in ("managers", "flights")}


def manager_table(results: Sequence[Result], seconds: float) -> list[str]:
    """One row for each process and fault, one column for each state; of repeated cells the slowest counts."""
    states = (IDLE, *map(str, STATES))
    lines = [f"| process | fault | noticed | {' | '.join(states)} |", "|---" * (3 + len(states)) + "|"]
    for process in dict.fromkeys(result.cell.process for result in results):
        for fault in Fault:
            row = [each for each in results if (each.cell.process, each.cell.fault) == (process, fault)]
            if not row:
                continue
            signs = [each.noticed for each in row if each.noticed is not None]
            noticed = str(max(signs, key=lambda sign: sign.after)) if len(signs) == len(row) else "**not always**"
            told = [_slowest([each for each in row if each.cell.state == state]) for state in states]
            lines.append(f"| {process} | {fault} | {noticed} | {' | '.join(told)} |")
    return [*lines, "", _footer(len(results), sum(each.kept for each in results), seconds)]


def flight_table(results: Sequence[FlightResult], seconds: float) -> list[str]:
    """One row for each flight."""
    lines = ["| process | fault | in | noticed | goals lost | the drone | on the ground after | the mission |"]
    lines.append("|---" * 8 + "|")
    for each in results:
        cell = each.cell
        landed = "–" if each.landed is None else f"{each.landed:.0f} s"
        columns = (
            cell.process,
            cell.fault,
            cell.moment,
            each.noticed or "**no**",
            ", ".join(dict.fromkeys(each.lost)) or "–",
            each.outcome,
            landed,
            each.mission,
        )
        lines.append(f"| {' | '.join(map(str, columns))} |")
    return [*lines, "", _footer(len(results), sum(each.kept for each in results), seconds)]


def told(result: Result) -> str:
    """One cell of the managers' table."""
    if not result.as_promised:
        times = f"free {_time(result.free)}, again {_time(result.again)}"
        return "; ".join([f"**broken**: {result.answer or 'no answer'}, {times}", *result.bad_chains])
    again = f"again {_time(result.again)}" + ("" if result.in_time else ", **late**")
    if result.answer is None:
        return again
    if not result.harmed:
        return f"{result.answer}, {again}"
    return f"**{result.answer}** {_time(result.answered)}, free {_time(result.free)}, {again}"


def _slowest(results: Sequence[Result]) -> str:
    if not results:
        return ""
    worst = max(results, key=lambda each: (not each.kept, each.again or 0.0))
    answers = list(dict.fromkeys(each.answer for each in results if each.answer))
    others = [answer for answer in answers if answer != worst.answer]
    return told(worst) + (f" (also {', '.join(others)})" if others else "")


def _time(seconds: float | None) -> str:
    return "never" if seconds is None else f"{seconds:.1f} s"


def _footer(cells: int, kept: int, seconds: float) -> str:
    load = os.getloadavg()[2]
    machine = f"{platform.machine()}, {os.cpu_count()} cores at a load of {load:.0f}"
    return f"{kept} of {cells} as promised, in {seconds / 60:.0f} min; {machine}, {date.today().isoformat()}."  # noqa: DTZ011
