"""Many mocked robots at one router: messages, processor time, memory, and the time of a goal.

python benchmarks/fleet.py [--robots 100] [--seconds 20] [--write]

Each robot has two processes: its resource manager, and all others (data manager, mocked skills, mocked world). One
client process of the benchmark starts a skill of each robot in turn.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, closing
from dataclasses import dataclass, replace
from itertools import count
from pathlib import Path

import zenoh
from performance_page import machine, make_parser, milliseconds, table, write_section

from skillwing.dsl import load
from skillwing.dsl.model import Skillset
from skillwing.services.bus.zenoh_bus import ZenohBus
from skillwing.services.bus.zenoh_session import open_client
from skillwing.services.client.interface import SkillsetInterface
from skillwing.services.mocking.system import mock_processes
from skillwing.services.names import RESOURCE_MANAGER
from skillwing.services.processes.launcher import ROUTER, Launcher
from skillwing.services.processes.proc_files import usage
from skillwing.services.robot import ProcessSpec, Robot

SKILLSET = """\
skillset shuttle {
    data { place: float64 [m] period=0.2  battery: float64 [%] period=1.0 }
    resource wheels { initial FREE  FREE -> USED  USED -> FREE }
    skill go {
        input { to: float64 [m] = 1.0 }
        effect { take: wheels -> USED  give: wheels -> FREE }
        precondition { free: resource=(wheels == FREE)  charged: data=(battery > 1.0)  success take }
        result { success THERE: apply=give }
    }
    skill wave { result { success WAVED } }
}
"""
SCRIPT = "[skill.go]\ndelay = 0.0\n[data]\nbattery = 90.0\n"
SETTLE = 5.0
"""Wall seconds between the start of everything and the measurement."""
TOGETHER = 4
"""Robots that are started at the same time."""
STARTS_PER_SECOND = 10.0
"""Starts of skills in all robots together, while the goals are timed."""
ANSWER_WITHIN = 30.0
ON_PAPER = 1000
"""Robots of the row that is computed."""


@dataclass(frozen=True)
class Load:
    """Load while the robots were watched. cpu: percent of one core; own: megabytes of a process's share."""

    messages: float
    router_cpu: float
    robots_cpu: float
    router_memory: float
    robot_memory: float


@dataclass(frozen=True)
class Fleet:
    """One number of robots as it was measured. started: seconds until all were there. goals: seconds of each goal."""

    robots: int
    started: float
    idle: Load
    busy: Load
    goals: Sequence[float]


def robot_processes(robot: Robot, scripts: Sequence[Path]) -> Iterator[ProcessSpec]:
    """The nodes of a mocked robot: the resource manager, and a process with all others."""
    for spec in mock_processes(robot, scripts=scripts):
        yield replace(spec, host=None if spec.name == RESOURCE_MANAGER else "others", essential=True)


def own_memory(pid: int) -> float:
    """Megabytes of a process, in which a page that several processes hold counts by its share."""
    lines = Path(f"/proc/{pid}/smaps_rollup").read_text(encoding="ascii").splitlines()[1:]
    kilobytes = {name: int(rest.split()[0]) for name, _, rest in (line.partition(":") for line in lines)}
    return kilobytes["Pss"] / 1024


def cpu(pids: Sequence[int]) -> float:
    """Processor seconds of these processes so far."""
    return sum(each.cpu for pid in pids if (each := usage(pid)) is not None)


class Watch:
    """Measurement of a running fleet. router, robots: process ids."""

    def __init__(self, endpoint: str, router: int, robots: Sequence[int]) -> None:
        self._endpoint = endpoint
        self._router = router
        self._robots = list(robots)

    def during(self, act: float | ZenohBus, seconds: float) -> Load:
        """Load in the next seconds. act: a bus that runs meanwhile, or 0 for none."""
        received = count()
        with open_client(self._endpoint, None) as session:
            callback = zenoh.handlers.Callback(lambda sample: next(received), indirect=False)
            subscriber = session.declare_subscriber("robot/**", callback)
            before, begun = (cpu([self._router]), cpu(self._robots)), time.monotonic()
            if isinstance(act, ZenohBus):
                act.run_until(lambda: False, seconds)
            else:
                time.sleep(seconds)
            passed, messages = time.monotonic() - begun, next(received)
            after = (cpu([self._router]), cpu(self._robots))
            subscriber.undeclare()
        return Load(
            messages / passed,
            100.0 * (after[0] - before[0]) / passed,
            100.0 * (after[1] - before[1]) / passed,
            own_memory(self._router),
            2.0 * sum(own_memory(pid) for pid in self._robots) / len(self._robots),
        )


class Starts:
    """Starts a skill of each robot in turn, and notes the time until its end."""

    def __init__(self, bus: ZenohBus, interfaces: Sequence[SkillsetInterface]) -> None:
        self.seconds: list[float] = []
        self._bus = bus
        self._interfaces = list(interfaces)
        self._next = 0
        for number, each in enumerate(self._interfaces):
            each.on_change(lambda number=number: self._look(number))
        self._begun: dict[int, tuple[float, object]] = {}
        bus.every(1.0 / STARTS_PER_SECOND, self._start)

    def _start(self) -> None:
        number, self._next = self._next, (self._next + 1) % len(self._interfaces)
        if number not in self._begun:
            begun = time.monotonic()
            self._begun[number] = (begun, self._interfaces[number].start("go"))

    def _look(self, number: int) -> None:
        begun, goal = self._begun.get(number, (0.0, None))
        if getattr(goal, "done", False):
            del self._begun[number]
            self.seconds.append(time.monotonic() - begun)


def measure(robots: int, seconds: float, folder: Path) -> Fleet:
    """Start so many robots at one router, and measure them idle and with starts."""
    file, script = folder / "shuttle.skillset", folder / "shuttle.mock.toml"
    file.write_text(SKILLSET, encoding="utf-8")
    script.write_text(SCRIPT, encoding="utf-8")
    skillset = load(file)
    with ExitStack() as stack:
        first = stack.enter_context(Launcher("router", skillset.name, folder / "router", clock="wall"))
        endpoint = first.start_router()
        begun = time.monotonic()
        launchers = [
            stack.enter_context(
                Launcher(f"r{number}", skillset.name, folder / f"r{number}", clock="wall", router=endpoint)
            )
            for number in range(robots)
        ]

        def start(launcher: Launcher) -> None:
            robot = Robot(name=launcher.robot, skillset=file, hooks={}, clock="wall")
            launcher.start(tuple(robot_processes(robot, [script])))

        with ThreadPoolExecutor(TOGETHER) as pool:
            list(pool.map(start, launchers))
        started = time.monotonic() - begun
        time.sleep(SETTLE)
        watch = Watch(endpoint, first.pids[ROUTER], [pid for each in launchers for pid in each.pids.values()])
        idle = watch.during(0.0, seconds)
        bus, interfaces = clients(endpoint, skillset, robots, stack)
        starts = Starts(bus, interfaces)
        busy = watch.during(bus, seconds)
    return Fleet(robots, started, idle, busy, starts.seconds)


def clients(
    endpoint: str, skillset: Skillset, robots: int, stack: ExitStack
) -> tuple[ZenohBus, list[SkillsetInterface]]:
    """A client of each robot, all in this thread."""
    buses: list[ZenohBus] = []
    for number in range(robots):
        bus = ZenohBus("benchmark", f"r{number}", endpoint, sibling=buses[0] if buses else None)
        buses.append(stack.enter_context(closing(bus)))
    interfaces = [SkillsetInterface(bus, skillset, client="benchmark") for bus in buses]
    if not buses[0].run_until(lambda: all(each.ready for each in interfaces), ANSWER_WITHIN):
        raise SystemExit("Not every robot has answered.")
    return buses[0], interfaces


def section(fleets: Sequence[Fleet]) -> str:
    """Text and table of the page."""
    rows = [
        [
            str(each.robots),
            what,
            f"{load_.messages:.0f}",
            f"{load_.router_cpu:.0f}",
            f"{load_.robots_cpu / each.robots:.1f}",
            f"{load_.router_memory:.0f}",
            f"{load_.robot_memory:.0f}",
            " / ".join(milliseconds(each.goals)) if what == "starts" and len(each.goals) > 1 else "",
        ]
        for each in fleets
        for what, load_ in (("idle", each.idle), ("starts", each.busy))
    ]
    heads = (
        *("robots", "load", "publications / s", "router, % of a core", "robot, % of a core"),
        *("router, MB", "robot, MB", "start to result, p50 / p99, ms"),
    )
    rows.append(computed(fleets))
    started = ", ".join(f"{each.robots} robots in {each.started:.0f} s" for each in fleets)
    return f"""Mocked robots at one router on one machine. A robot has two processes: its resource manager, and all
others. It publishes two data (5 Hz and 1 Hz) and has two skills. *Starts* are {STARTS_PER_SECOND:g} per second in all
robots together, by one client process. Publications are those that an observer of all robots receives. Megabytes are
the shares of a process. Up were {started}. {machine()}.

The last row is on paper: a straight line through the last two numbers of robots, idle. One core is 100 %: above it, one
router is too few.

{table(heads, rows)}"""


def computed(fleets: Sequence[Fleet]) -> list[str]:
    """The row of `ON_PAPER` robots, by the last two numbers of robots."""
    one, other = fleets[-2:]

    def line(value: Callable[[Load], float]) -> float:
        low, high = value(one.idle), value(other.idle)
        return high + (high - low) / (other.robots - one.robots) * (ON_PAPER - other.robots)

    return [
        f"{ON_PAPER:,}",
        "on paper",
        f"{line(lambda load_: load_.messages):,.0f}",
        f"{line(lambda load_: load_.router_cpu):.0f}",
        f"{line(lambda load_: load_.robots_cpu) / ON_PAPER:.1f}",
        f"{line(lambda load_: load_.router_memory):.0f}",
        f"{other.idle.robot_memory:.0f}",
        "",
    ]


def main() -> None:
    options = make_parser(__doc__)
    options.add_argument(
        "--robots", type=int, nargs="+", default=[10, 50, 100], help="numbers of robots, one after the other"
    )
    options.add_argument("--seconds", type=float, default=20.0, help="length of each measurement")
    given = options.parse_args()
    fleets: list[Fleet] = []
    for robots in given.robots:
        with tempfile.TemporaryDirectory() as folder:
            fleets.append(measure(robots, given.seconds, Path(folder)))
    write_section("fleet.py", "Many robots", section(fleets), write=given.write)


if __name__ == "__main__":
    main()
