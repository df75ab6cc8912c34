"""Start-up time of the command line: for the list of commands and for one command's help.

python benchmarks/command_line.py [--write]
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

from performance_page import against, machine, make_parser, table, write_section

RUNS = 11
BUDGET = 0.3
SKILLWING = str(Path(sys.executable).with_name("skillwing"))
PYTHON = "Python alone"
HELP = "`skillwing --help`"
COMMANDS = {
    PYTHON: [sys.executable, "-c", "pass"],
    HELP: [SKILLWING, "--help"],
    "`skillwing start --help`": [SKILLWING, "start", "--help"],
    "`skillwing up --help`": [SKILLWING, "up", "--help"],
    "`skillwing demo --help`": [SKILLWING, "demo", "--help"],
}


def _once(command: list[str], environment: dict[str, str]) -> tuple[float, float]:
    """Wall and processor seconds of a command."""
    used, begun = _processor_time(), time.perf_counter()
    subprocess.run(command, stdout=subprocess.DEVNULL, check=True, env=environment)
    return time.perf_counter() - begun, _processor_time() - used


def _processor_time() -> float:
    """Processor time of the ended child processes [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def main() -> None:
    given = make_parser(__doc__).parse_args()
    measured: dict[str, list[tuple[float, float]]] = {name: [] for name in COMMANDS}
    with tempfile.TemporaryDirectory() as compiled:
        environment = {**os.environ, "PYTHONPYCACHEPREFIX": compiled}
        environment.pop("PYTHONDONTWRITEBYTECODE", None)
        for command in COMMANDS.values():
            _once(command, environment)  # compiles what it imports, as an installation does
        for _ in range(RUNS):
            for name, command in COMMANDS.items():
                measured[name].append(_once(command, environment))
    rows: list[list[str]] = []
    for name, runs in measured.items():
        walls, used = [wall for wall, _ in runs], [cpu for _, cpu in runs]
        kept = against(BUDGET, median(walls)) if name == HELP else ""
        rows.append([name, f"{median(walls):.3f}", f"{min(walls):.3f} to {max(walls):.3f}", f"{min(used):.3f}", kept])
    heads = ("command", "median, s", "least to most, s", "least processor time, s", f"budget of {BUDGET:g} s")
    body = f"""{RUNS} runs of each, by turns; modules were compiled before. A list of all commands loads none of them.
{machine()}.

{table(heads, rows)}"""
    write_section("command_line.py", "The command line", body, write=given.write)


if __name__ == "__main__":
    main()
