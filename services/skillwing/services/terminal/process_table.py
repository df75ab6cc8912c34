"""A system's processes as a table, for `up`, `status` and `top`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from rich.table import Table
from rich.text import Text

from skillwing.services.processes.proc_files import Usage
from skillwing.services.processes.process_monitor import ProcessStatus
from skillwing.services.processes.process_state import ProcessCondition
from skillwing.services.terminal.output import make_table

STYLES = {
    ProcessCondition.RUNS: "green",
    ProcessCondition.STARTS: "yellow",
    ProcessCondition.SILENT: "red",
    ProcessCondition.RESTARTS: "yellow",
    ProcessCondition.DOWN: "red",
}
MEBIBYTE = 1 << 20


def process_table(entries: Iterable[ProcessStatus], cpu: Mapping[str, float] | None = None) -> Table:
    """One line for each process. cpu: percent of one core by name; with it the table shows CPU and memory, too.

    Nodes that share a process have lines below it. With cpu there is less room, and the line gives their number.
    """
    loads = ("CPU %", "MEMORY") if cpu is not None else ()
    table = make_table(("PROCESS", "STATE", "PID", "UP", "RESTARTS", *loads), right=("PID", "UP", "RESTARTS", *loads))
    for entry in entries:
        state, used = entry.state, entry.used
        pid = "" if used is None else str(state.pid)
        up = "" if used is None else duration(used.uptime)
        load = () if cpu is None else ("", "") if used is None else _load(cpu.get(state.name, 0.0), used)
        nodes = f" ({len(state.nodes)} nodes)" if state.nodes and cpu is not None else ""
        shown = Text(entry.condition, style=STYLES[entry.condition])
        table.add_row(f"{state.name}{nodes}", shown, pid, up, str(state.restarts or ""), *load)
        if cpu is None:
            for node, how in entry.nodes.items():
                table.add_row(f"  {node}", Text(how, style=STYLES[how]), "", "", "")
    return table


def _load(cpu: float, used: Usage) -> tuple[str, str]:
    return f"{cpu:.1f}", f"{used.memory / MEBIBYTE:.0f} MB"


def process_facts(entry: ProcessStatus) -> dict[str, Any]:
    """The same facts about one process for JSON."""
    return {
        "state": entry.condition,
        "pid": entry.state.pid,
        "uptime_s": None if entry.used is None else round(entry.used.uptime, 1),
        "restarts": entry.state.restarts,
        "essential": entry.state.essential,
        "last_words": entry.state.last_words or None,
        "nodes": dict(entry.nodes),
    }


def duration(seconds: float) -> str:
    """`12 s`, `3 min 20 s`, `2 h 05 min`."""
    minutes, rest = divmod(int(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    if hours:
        return f"{hours} h {minutes:02d} min"
    return f"{minutes} min {rest:02d} s" if minutes else f"{rest} s"
