"""All managers of the m600 as they stand idle beside its simulator: their start-up, processor time and memory.

python benchmarks/managers.py [--seconds 20] [--write]

First with a process for each manager, then with `--colocate` and with `--topology mesh`, one system after the other.
"""

from __future__ import annotations

import tempfile
import time
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from performance_page import against, machine, make_parser, table, write_section

from skillwing.m600.robot import ROBOT
from skillwing.services.bus import Topology
from skillwing.services.bus.clock import FollowedClock
from skillwing.services.bus.zenoh_bus import ZenohBus
from skillwing.services.processes.colocation import colocated, process_groups
from skillwing.services.processes.launcher import ROUTER, Launcher
from skillwing.services.processes.proc_files import usage

SETTLE = 5.0
"""Wall seconds between the start of everything and the measurement."""
CPU_BUDGET, CPU_TARGET = 5.0, 3.0
"""Percent of one core, for all managers."""
MEMORY_BUDGET = 60.0
"""Resident megabytes of a manager."""


@dataclass(frozen=True)
class Instant:
    """Seconds so far at one instant: real time, robot time, and processor time of each process that lives."""

    real: float
    robot: float
    cpu: dict[str, float]


@dataclass(frozen=True)
class Idle:
    """Idle load of a process of a layout.

    cpu: percent of one core; resident: megabytes; own: megabytes of its share, in which a page that several processes
    hold counts for each of them by its part.
    """

    cpu: float
    resident: float
    own: float


@dataclass(frozen=True)
class Layout:
    """One system as it was watched: seconds until all managers were there and of watching, the pace of robot time."""

    name: str
    started: float
    watched: float
    pace: float
    router: Idle
    managers: dict[str, Idle]

    @property
    def cpu(self) -> float:
        return sum(each.cpu for each in self.managers.values())

    @property
    def largest(self) -> float:
        return max(each.resident for each in self.managers.values())


def _memory(pid: int) -> tuple[float, float]:
    """Resident megabytes of a process, and its share of them (`man 5 proc`, smaps_rollup)."""
    lines = Path(f"/proc/{pid}/smaps_rollup").read_text(encoding="ascii").splitlines()[1:]
    kilobytes = {name: int(rest.split()[0]) for name, _, rest in (line.partition(":") for line in lines)}
    return kilobytes["Rss"] / 1024, kilobytes["Pss"] / 1024


def _measure(endpoint: str, pids: dict[str, int], seconds: float) -> tuple[Instant, Instant]:
    """Begin and end of an interval. The session opens before it: that takes time of its own."""
    clock = FollowedClock()

    def now() -> Instant:
        found = {name: usage(pid) for name, pid in pids.items()}
        cpu = {name: each.cpu for name, each in found.items() if each is not None}
        return Instant(time.monotonic(), clock.now(), cpu)

    with closing(ZenohBus("benchmark", ROBOT.name, endpoint, clock)) as bus:
        bus.run_until(clock.has_started, SETTLE)
        begin = now()
        bus.run_until(lambda: False, seconds)
        return begin, now()


def watch(name: str, seconds: float, *, colocate: bool = False, topology: Topology = "router") -> Layout:
    """Start a system, let it stand idle, and look at its managers."""
    specs = colocated(ROBOT.managers()) if colocate else ROBOT.managers()
    with tempfile.TemporaryDirectory() as folder:
        model = ROBOT.load_skillset()
        with Launcher(ROBOT.name, model.name, Path(folder), clock=ROBOT.clock, topology=topology) as launcher:
            launcher.start(ROBOT.functional_layer({}))
            begun = time.monotonic()
            launcher.start(specs)
            started = time.monotonic() - begun
            time.sleep(SETTLE)
            ours = {ROUTER, *(each.name for each in process_groups(specs))}
            pids = {process: pid for process, pid in launcher.pids.items() if process in ours}
            begin, end = _measure(launcher.endpoint, pids, seconds)
            watched = end.real - begin.real
            pace = (end.robot - begin.robot) / watched
            idle = {
                process: Idle(100.0 * (end.cpu[process] - begin.cpu[process]) / watched, *_memory(pid))
                for process, pid in pids.items()
            }
    return Layout(name, started, watched, pace, idle.pop(ROUTER), idle)


def section(usual: Layout, others: list[Layout]) -> str:
    layouts = [
        [
            each.name,
            str(len(each.managers)),
            f"{each.started:.2f}",
            f"{each.cpu:.1f}",
            f"{each.router.cpu:.1f}",
            f"{sum(idle.own for idle in each.managers.values()):.0f}",
            f"{each.largest:.0f}",
            f"{each.pace:.2f}",
        ]
        for each in (usual, *others)
    ]
    heads = ("layout", "processes", "all there, s", "% of a core", "router, %", "MB together", "largest, MB", "pace")
    processes = [
        [f"`{name}`", f"{idle.cpu:.2f}", f"{idle.resident:.0f}", f"{idle.own:.0f}"]
        for name, idle in {ROUTER: usual.router, **usual.managers}.items()
    ]
    count = len(ROBOT.managers())
    return f"""The {count} managers of the m600 beside a running simulator, idle for {usual.watched:.0f} s.
With a process for each they used together **{usual.cpu:.1f} % of one core** (budget of {CPU_BUDGET:g} %:
{against(CPU_BUDGET, usual.cpu)}; target of {CPU_TARGET:g} %: {against(CPU_TARGET, usual.cpu)}), the largest of them
{usual.largest:.0f} MB (budget of {MEMORY_BUDGET:g} MB:
{against(MEMORY_BUDGET, usual.largest)}). {machine()}.

{table(heads, layouts)}

Processes and percent are those of the managers, without the router. Seconds are from the start of the managers until
all have said that they are there. *MB together* counts a page that several processes hold once, *largest* is resident
memory with all that is shared. Pace is robot time to real time.

{table(("process", "% of a core", "resident MB", "own share, MB"), processes)}"""


def main() -> None:
    options = make_parser(__doc__)
    options.add_argument("--seconds", type=float, default=20.0, help="how long to watch the idle managers")
    given = options.parse_args()
    usual = watch("a process each", given.seconds)
    others = [
        watch("`--colocate`", given.seconds, colocate=True),
        watch("`--topology mesh`", given.seconds, topology="mesh"),
        watch("`--colocate --topology mesh`", given.seconds, colocate=True, topology="mesh"),
    ]
    write_section("managers.py", "Idle managers", section(usual, others), write=given.write)


if __name__ == "__main__":
    main()
