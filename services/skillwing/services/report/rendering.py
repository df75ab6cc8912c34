"""A mission's report in Markdown for `report.md`, and as a table for the terminal."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import msgspec
from rich.table import Table

from skillwing.dsl.whole_files import write_whole
from skillwing.services.history.history import GoalOutcome, History, SkillBar
from skillwing.services.history.report import REPORT_FILE, RESULTS, MissionReport, ProcessEntry, last_phase
from skillwing.services.history.wording import abridge, brief, chain_text, ends, headlines
from skillwing.services.protocol import Ending

REPORT_TEXT_FILE = "report.md"
MISSING = "not recorded"
"""Name of the row for what is missing in a recording."""

_FROM_OUTSIDE = frozenset({Ending.NOT_READY, Ending.INVARIANT_VIOLATED, Ending.LOST})
_AS_USUAL = frozenset({"runs", "stopped"})


def write_report(report: MissionReport, history: History, run_dir: Path, notes: Sequence[str] = ()) -> None:
    """Write `report.md` and `report.json`. notes: sentences for readers of the figures. Raises OSError."""
    run_dir.mkdir(parents=True, exist_ok=True)
    write_whole(run_dir / REPORT_TEXT_FILE, as_markdown(report, history, notes).encode())
    as_json = msgspec.json.format(msgspec.json.encode(report), indent=2)
    write_whole(run_dir / REPORT_FILE, as_json + b"\n")


def figures(report: MissionReport) -> list[tuple[str, str]]:
    """The figures of a run by name, the most important first."""
    rows = [
        ("result", report.result),
        ("robot time", _seconds(report.sim_time_s)),
        ("wall time", _seconds(report.wall_time_s)),
        ("real-time factor", "not known" if report.real_time_factor is None else f"{report.real_time_factor:.2f}"),
        *((figure.name, figure.text) for figure in report.judged),
    ]
    rows += [(f"switch at {switch.t:.1f} s", chain_text(switch.cause)) for switch in report.switches]
    rows += [(f"{process.name} died", process.detail) for process in report.processes if process.state == "died"]
    rows += [(MISSING, sentence) for sentence in report.missing]
    return rows


def summary_table(report: MissionReport) -> Table:
    """Title and figures for the terminal."""
    seed = "" if report.seed is None else f" (seed {report.seed})"
    table = Table(title=f"Mission {report.mission}{seed}", show_header=False, title_justify="left")
    table.add_column(style="bold", no_wrap=True)
    table.add_column(overflow="fold")
    styles = {"result": "green" if report.result == "success" else "red"}
    styles |= {figure.name: "red" for figure in report.judged if figure.is_problem}
    for name, value in figures(report):
        style = "red" if name == MISSING or name.endswith(" died") else styles.get(name)
        table.add_row(name, value, style=style)
    return table


def as_markdown(report: MissionReport, history: History, notes: Sequence[str] = ()) -> str:
    lines = [f"# Mission `{report.mission}`: {report.result}", ""]
    end = last_phase(history, report.mission)
    if end is not None and end.text and end.after in RESULTS:
        lines += [f"{end.text.removesuffix('.')}.", ""]
    seed = [] if report.seed is None else [("seed", str(report.seed))]
    lines += ["| figure | value |", "|---|---|"]
    lines += [f"| {name.strip()} | {_cell(value)} |" for name, value in (*seed, *figures(report))]
    lines += ["", *(f"{note}\n" for note in notes)]
    for switch in history.switches:
        lines += [f"## Switch at {switch.t:.1f} s: {switch.before} -> {switch.after}", ""]
        lines += [f"{number}. {record.t:.3f} s  {brief(record)}" for number, record in enumerate(ends(switch.chain), 1)]
        lines.append("")
    lines += ["## Skills", "", "| from [s] | to [s] | skill | end | reason | because |", "|---:|---:|---|---|---|---|"]
    for bar in history.bars:
        until = "" if bar.t_end is None else f"{bar.t_end:.1f}"
        how = bar.terminal or GoalOutcome.RUNNING
        because = _cell(_because(bar, history))
        lines.append(f"| {bar.t_start:.1f} | {until} | {bar.skill} | {how} | {_cell(bar.reason)} | {because} |")
    if report.processes:
        lines += ["", "## Processes", "", *_processes(report.processes)]
    return "\n".join(lines).rstrip() + "\n"


def _because(bar: SkillBar, history: History) -> str:
    """The causes, nearest first, of the end of a goal that the robot's state refused or ended."""
    if bar.terminal not in _FROM_OUTSIDE:
        return ""
    causes = [record for record in history.chain(bar.record) if record.goal_id != bar.goal_id]
    return " <- ".join(reversed(abridge(headlines(causes))))


def _processes(entries: Sequence[ProcessEntry]) -> list[str]:
    """A row for each process with an event, and one line for the others."""
    told = [entry for entry in entries if entry.detail or entry.state not in _AS_USUAL]
    others = [f"`{entry.name}`" for entry in entries if entry not in told]
    rows = [f"| {entry.name} | {entry.state} | {_cell(entry.detail)} |" for entry in told]
    table = ["| process | state | detail |", "|---|---|---|", *rows, ""] if rows else []
    return table + ([f"Nothing happened to {', '.join(others)}."] if others else [])


def _seconds(value: float | None) -> str:
    return "not known" if value is None else f"{value:.1f} s"


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("\n", " ")
