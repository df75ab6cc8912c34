"""The report of a run: `report.json` for programs, `report.md` for readers, a table for the terminal."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

import msgspec
from rich.table import Table

from skillwing.services.history.history import PHASES, History, Outcome, SkillBar
from skillwing.services.history.wording import abridged, brief, ends, headlines, in_words
from skillwing.services.protocol import Ending, Record, RecordKind

REPORT_FILE = "report.json"
REPORT_TEXT_FILE = "report.md"

_RESULTS = {"SUCCEEDED": "success", "FAILED": "failure", "ABORTED": "aborted"}
_UNFINISHED = "unfinished"
_FROM_OUTSIDE = frozenset({Ending.NOT_READY, Ending.INVARIANT_VIOLATED, Ending.LOST})
_AS_USUAL = frozenset({"runs", "stopped"})


class Coverage(msgspec.Struct, frozen=True, kw_only=True):
    """Shares of the observable surface that were mapped, 0 to 1; None where nothing could be judged."""

    all: float | None = None
    buildings: float | None = None
    terrain: float | None = None


class SwitchEntry(msgspec.Struct, frozen=True, kw_only=True):
    """A change of branch at `t`, and the records that led to it, from the root cause to the switch itself."""

    t: float
    cause: tuple[Record, ...]


class SkillEntry(msgspec.Struct, frozen=True, kw_only=True):
    """One goal; `t_end` and `terminal` are None if it never ended."""

    skill: str
    goal_id: str
    t_start: float
    t_end: float | None
    terminal: str | None
    reason: str


class ProcessEntry(msgspec.Struct, frozen=True, kw_only=True):
    """What became of a process; `detail` says how. state: `runs`, `stopped` in good order, `died` or `not started`."""

    name: str
    state: str
    detail: str = ""


class Witnessed(msgspec.Struct, frozen=True, kw_only=True):
    """What whoever ran a system knows of its last mission, besides what was recorded."""

    wall_time_s: float | None = None
    processes: tuple[ProcessEntry, ...] = ()


class Report(msgspec.Struct, frozen=True, kw_only=True):
    """`result` is success, failure, aborted or unfinished. Clearance is from the nearest obstacle to what holds the
    whole vehicle; it and collisions are None if no truth was recorded."""

    mission: str
    result: str
    seed: int | None
    sim_time_s: float
    wall_time_s: float | None
    real_time_factor: float | None
    collisions: int | None
    min_clearance_m: float | None
    coverage: Coverage
    switches: tuple[SwitchEntry, ...]
    skills: tuple[SkillEntry, ...]
    processes: tuple[ProcessEntry, ...]


def make_report(
    history: History,
    *,
    mission: str,
    seed: int | None = None,
    wall_time_s: float | None = None,
    collisions: int | None = None,
    min_clearance_m: float | None = None,
    coverage: Coverage | None = None,
    processes: Iterable[ProcessEntry] = (),
) -> Report:
    """The report of `history`, with what only others know. Times are rounded to milliseconds.

    wall_time_s: until the mission's end, as the robot time is; of one that had none, until the last record.
    """
    end = _last_phase(history, mission)
    sim_time = end.t if end is not None and end.after in _RESULTS else history.end
    return Report(
        mission=mission,
        result=_RESULTS.get(end.after, _UNFINISHED) if end else _UNFINISHED,
        seed=seed,
        sim_time_s=round(sim_time, 3),
        wall_time_s=None if wall_time_s is None else round(wall_time_s, 3),
        real_time_factor=round(sim_time / wall_time_s, 3) if wall_time_s else None,
        collisions=collisions,
        min_clearance_m=None if min_clearance_m is None else round(min_clearance_m, 3),
        coverage=coverage or Coverage(),
        switches=tuple(SwitchEntry(t=round(switch.t, 3), cause=switch.chain) for switch in history.switches),
        skills=tuple(
            SkillEntry(
                skill=bar.skill,
                goal_id=bar.goal_id,
                t_start=round(bar.t_start, 3),
                t_end=None if bar.t_end is None else round(bar.t_end, 3),
                terminal=bar.terminal,
                reason=bar.reason,
            )
            for bar in history.bars
        ),
        processes=tuple(processes),
    )


def write_report(report: Report, history: History, run_dir: Path, notes: Sequence[str] = ()) -> None:
    """Write both files; `notes` are sentences that a reader of the figures must know."""
    run_dir.mkdir(parents=True, exist_ok=True)
    as_json = msgspec.json.format(msgspec.json.encode(report), indent=2)
    (run_dir / REPORT_FILE).write_bytes(as_json + b"\n")
    (run_dir / REPORT_TEXT_FILE).write_text(as_markdown(report, history, notes), encoding="utf-8")


def read_report(run_dir: Path) -> Report:
    return msgspec.json.decode((run_dir / REPORT_FILE).read_bytes(), type=Report)


def figures(report: Report) -> list[tuple[str, str]]:
    """The figures of a run by name, in the order in which one asks for them."""
    rows = [
        ("result", report.result),
        ("robot time", _seconds(report.sim_time_s)),
        ("wall time", _seconds(report.wall_time_s)),
        ("real-time factor", "not known" if report.real_time_factor is None else f"{report.real_time_factor:.2f}"),
        ("collisions", "not known" if report.collisions is None else str(report.collisions)),
        (
            "least clearance",
            "not known" if report.min_clearance_m is None else f"{report.min_clearance_m:.2f} m",
        ),
        ("coverage", _percent(report.coverage.all)),
        ("  of buildings", _percent(report.coverage.buildings)),
        ("  of terrain", _percent(report.coverage.terrain)),
    ]
    rows += [(f"switch at {switch.t:.1f} s", in_words(switch.cause)) for switch in report.switches]
    rows += [(f"{process.name} died", process.detail) for process in report.processes if process.state == "died"]
    return rows


def summary_table(report: Report) -> Table:
    """The run for the terminal: a title and the figures."""
    seed = "" if report.seed is None else f" (seed {report.seed})"
    table = Table(title=f"Mission {report.mission}{seed}", show_header=False, title_justify="left")
    table.add_column(style="bold", no_wrap=True)
    table.add_column(overflow="fold")
    styles = {"result": "green" if report.result == "success" else "red"}
    for name, value in figures(report):
        style = "red" if name.endswith(" died") or (name == "collisions" and report.collisions) else styles.get(name)
        table.add_row(name, value, style=style)
    return table


def as_markdown(report: Report, history: History, notes: Sequence[str] = ()) -> str:
    lines = [f"# Mission `{report.mission}`: {report.result}", ""]
    end = _last_phase(history, report.mission)
    if end is not None and end.text and end.after in _RESULTS:
        lines += [f"{end.text.removesuffix('.')}.", ""]
    seed = [] if report.seed is None else [("world's seed", str(report.seed))]
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
        how = bar.terminal or Outcome.RUNNING
        because = _cell(_because(bar, history))
        lines.append(f"| {bar.t_start:.1f} | {until} | {bar.skill} | {how} | {_cell(bar.reason)} | {because} |")
    if report.processes:
        lines += ["", "## Processes", "", *_processes(report.processes)]
    return "\n".join(lines).rstrip() + "\n"


def _because(bar: SkillBar, history: History) -> str:
    """Of a goal that the state of the robot refused or ended: what that came from, nearest first."""
    if bar.terminal not in _FROM_OUTSIDE:
        return ""
    causes = [record for record in history.chain(bar.record) if record.goal_id != bar.goal_id]
    return " <- ".join(reversed(abridged(headlines(causes))))


def _processes(entries: Sequence[ProcessEntry]) -> list[str]:
    """A row for each process of which there is something to tell, and the others in one line."""
    told = [entry for entry in entries if entry.detail or entry.state not in _AS_USUAL]
    others = [f"`{entry.name}`" for entry in entries if entry not in told]
    rows = [f"| {entry.name} | {entry.state} | {_cell(entry.detail)} |" for entry in told]
    table = ["| process | state | detail |", "|---|---|---|", *rows, ""] if rows else []
    return table + ([f"Nothing happened to {', '.join(others)}."] if others else [])


def _last_phase(history: History, mission: str) -> Record | None:
    """The mission's latest phase record."""
    phases = (
        record
        for record in reversed(history.records)
        if record.kind is RecordKind.MISSION and record.subject == mission and record.after in PHASES
    )
    return next(phases, None)


def _seconds(value: float | None) -> str:
    return "not known" if value is None else f"{value:.1f} s"


def _percent(share: float | None) -> str:
    return "not known" if share is None else f"{100 * share:.1f} %"


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("\n", " ")
