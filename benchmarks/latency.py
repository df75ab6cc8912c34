"""Latency and processor time of skills: start, end and observed end, compared with Zenoh alone and with ROS 1.

python benchmarks/latency.py [--topology mesh] [--blocks 12] [--calls 25] [--write]

Router, managers, the raw Zenoh client, the client of skills and the mission are processes of their own, on loopback.
One of them at a time measures a block of calls, in turns, so that other load on the machine affects all of them. A
second system takes turns with the first one. It has one more process, which receives everything, as a recorder does;
with `--topology mesh`, its processes are peers instead.
"""

from __future__ import annotations

import shutil
import sys
from collections.abc import Iterable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median

from checkouts import HERE, ROOT, code_of, script
from peer_process import PeerError, PeerProcess, own_processes
from performance_page import (
    against,
    block_ratio,
    machine,
    make_parser,
    milliseconds,
    percentile_99,
    ratio,
    table,
    write_section,
)

ROLES = ("raw", "client", "mission")
STARTING = {
    "client": "client",
    "skill/act": "skill manager",
    "resource_manager": "resource manager",
    "router": "router",
}
"""Processes that a start goes through. All others only listen."""
BUDGET = 2.5
"""Largest permitted ratio to Zenoh alone."""
CPU_TARGET = 3.0
"""Target for the processor time of a start, all processes [ms]."""
BLOCK_LIMIT = 300.0
ROS_PYTHON = "/usr/bin/python3"
ROS_START_LIMIT = 60.0
SLOW_ACTION = 0.05
"""Time beyond which an action of actionlib counts as slow [s]. Its client misses some results and polls after 0.1 s.
With such calls a median jumps between two values, so that a ratio to all calls would say nothing."""


@dataclass
class Block:
    """Durations of the calls, by kind [s]; processor time per start, by process [s]."""

    query: list[float] = field(default_factory=list[float])
    hop: list[float] = field(default_factory=list[float])
    dispatched: list[float] = field(default_factory=list[float])
    result: list[float] = field(default_factory=list[float])
    seen: list[float] = field(default_factory=list[float])
    actionlib: list[float] = field(default_factory=list[float])
    cpu: dict[str, float] = field(default_factory=dict[str, float])
    publications: float = 0.0
    """Publications per start that a recorder receives."""

    @property
    def start_cpu(self) -> float:
        """Processor time of a start, in all processes that it goes through [s]."""
        return sum(self.cpu[name] for name in STARTING)


def open_system(
    stack: ExitStack, tree: Path = ROOT, topology: str = "router", *, recorded: bool = False
) -> PeerProcess:
    """A system of a checkout. It ends with the stack."""
    recorder = ["recorder"] if recorded else []
    return stack.enter_context(PeerProcess(script("latency_system.py", topology, *recorder), code_of(tree)))


def open_actionlib(stack: ExitStack) -> tuple[PeerProcess | None, str]:
    """actionlib, if it is installed and starts in time; otherwise a sentence for its absence."""
    roscore = shutil.which("roscore")
    if roscore is None or not Path(ROS_PYTHON).exists():
        return None, "ROS 1 is not installed here."
    command = script("ros_system.py", roscore, ROS_PYTHON, str(HERE / "ros_peer.py"), f"{ROS_START_LIMIT:g}")
    try:
        return stack.enter_context(PeerProcess(command, code_of(ROOT), 3 * ROS_START_LIMIT)), ""
    except PeerError as error:
        return None, f"ROS 1 did not start: {error}"


def measure_block(system: PeerProcess, role: str, calls: int, block: Block) -> None:
    """Let one role of a system measure its calls, and put the times into the block."""
    answer = system.ask({"role": role, "calls": calls}, BLOCK_LIMIT)
    for kind, found in answer["times"].items():
        getattr(block, kind).extend(found)
    if role == "client":
        block.cpu = {name: seconds / calls for name, seconds in answer["cpu"].items()}
        block.publications = answer["publications"] / calls


def turns(names: Iterable[str], number: int) -> list[str]:
    """Order of a round: forwards and backwards by turns, so that none has the advantage of its place."""
    return list(names) if number % 2 == 0 else list(names)[::-1]


def measure(
    systems: Mapping[str, PeerProcess], blocks: int, calls: int, actionlib: PeerProcess | None = None
) -> dict[str, list[Block]]:
    """Blocks of calls on each system, role by role in turns. The first block is a warm-up and does not count.

    actionlib: takes turns, too. Its times go into the blocks of the first system. After a failure, it is left out.
    """
    measured: dict[str, list[Block]] = {name: [] for name in systems}
    for number in range(blocks + 1):
        block = {name: Block() for name in systems}
        for role in ROLES:
            for name in turns(systems, number):
                measure_block(systems[name], role, calls, block[name])
        if actionlib is not None:
            try:
                next(iter(block.values())).actionlib = actionlib.ask({"calls": calls}, BLOCK_LIMIT)["result"]
            except PeerError:
                actionlib = None
        for name in systems:
            measured[name].append(block[name])
    return {name: found[1:] for name, found in measured.items()}


@dataclass(frozen=True)
class Row:
    """A measured quantity: label, field of `Block`, field of its base, and budget as a ratio to that base.

    target: for median and 99th percentile [ms], on a machine with a load below 4.
    """

    label: str
    kind: str
    base: str = ""
    budget: float | None = None
    target: tuple[float, ...] = ()


ROWS = (
    Row("raw Zenoh: query and answer", "query"),
    Row("raw Zenoh: one publication", "hop"),
    Row("start of a skill, until `on_dispatch`", "dispatched", "query", BUDGET, (1.6,)),
    Row("start of a skill, until its result", "result", "query", None, (2.7, 6.0)),
    Row("extern transition, until the mission's tree has seen `RI`", "seen", "hop", BUDGET, (1.3, 5.0)),
)


def times(blocks: list[Block], kind: str) -> list[float]:
    return [each for block in blocks for each in getattr(block, kind)]


def pairs(blocks: list[Block], kind: str, base: str) -> list[tuple[list[float], list[float]]]:
    return [(getattr(block, kind), getattr(block, base)) for block in blocks]


def ratio_to_raw(blocks: list[Block], row: Row) -> str:
    """Cell: ratio to plain Zenoh in the same block, and its budget."""
    if not row.base:
        return ""
    found = pairs(blocks, row.kind, row.base)
    if row.budget is None:
        return ratio(found)
    return f"{ratio(found)}; budget {row.budget:g}: {against(row.budget, block_ratio(found))}"


def against_target(row: Row, measured: list[float]) -> str:
    """Cell: targets of a row, each with its result. measured: durations of its calls [s]."""
    named = zip(("p50", "p99"), row.target, (median(measured), percentile_99(measured)), strict=False)
    return "; ".join(f"{name} {limit:g}: {against(limit, 1e3 * found)}" for name, limit, found in named)


def beside_actionlib(ours: list[float], actions: list[float]) -> str:
    """Cell: share of slow actions, and the ratio of medians to the others. ours, actions: durations [s]."""
    quick = [each for each in actions if each <= SLOW_ACTION]
    share = f"{1 - len(quick) / len(actions):.0%} of the calls took more than {1e3 * SLOW_ACTION:g} ms"
    return f"{share}; ours to the others: {median(ours) / median(quick):.2f}" if quick else share


def start_cpu(blocks: list[Block]) -> float:
    """Processor time of a start, the median of the blocks [ms]."""
    return 1e3 * median(block.start_cpu for block in blocks)


def section(blocks: list[Block], recorded: list[Block], absence: str) -> str:
    rows: list[list[str]] = []
    for row in ROWS:
        found = milliseconds(times(blocks, row.kind))
        cpu = f"{start_cpu(blocks):.1f}" if row.kind == "result" else ""
        target = against_target(row, times(blocks, row.kind))
        rows.append([row.label, *found, target, cpu, ratio_to_raw(blocks, row)])
    if all(block.actionlib for block in blocks):
        compared = beside_actionlib(times(blocks, "result"), times(blocks, "actionlib"))
        found = milliseconds(times(blocks, "actionlib"))
        rows.append(["rospy + actionlib: start of an action, until its result", *found, "", "", compared])
    elif not absence:
        absence = "ROS 1 did not answer in time."
    heads = ("", "p50, ms", "p99, ms", "target, ms", "CPU per start, ms", "ratio to raw Zenoh (blocks)")
    return f"""Router, managers, raw client, client and mission are processes of their own on one machine. The
journal is on, and raw messages are as long as ours. {_how_measured(blocks)} {absence}

{table(heads, rows)}

Processor time of a start, by process (target for the sum: {CPU_TARGET:g} ms,
{against(CPU_TARGET, start_cpu(blocks))}). The mission, the data manager and the other skill manager only listen.

{cpu_table(blocks)}

A second system took turns. It has one more process, *a recorder*, which receives everything and decodes nothing. It
received {median(block.publications for block in recorded):.1f} publications of a start.

{recorder_table(blocks, recorded)}"""


def recorder_table(blocks: list[Block], recorded: list[Block]) -> str:
    """Times of the system with a recorder, and their ratio to those without one."""
    rows: list[list[str]] = []
    for row in ROWS:
        compared = [
            (getattr(with_it, row.kind), getattr(without, row.kind))
            for with_it, without in zip(recorded, blocks, strict=True)
        ]
        rows.append([f"with a recorder: {row.label}", *milliseconds(times(recorded, row.kind)), ratio(compared)])
    rows.append(["with a recorder: CPU per start, sum", f"{start_cpu(recorded):.2f}", "", ""])
    return table(("", "p50, ms", "p99, ms", "ratio to no recorder (blocks)"), rows)


def cpu_table(blocks: list[Block]) -> str:
    """Processor time per start: each process, those that listen together, and the sum without these."""
    each = {name: 1e3 * median(block.cpu[name] for block in blocks) for name in blocks[0].cpu}
    listening = sum(value for name, value in each.items() if name not in STARTING)
    rows = [[label, f"{each[name]:.2f}"] for name, label in STARTING.items()]
    rows += [["**sum**", f"{start_cpu(blocks):.2f}"], ["processes that listen", f"{listening:.2f}"]]
    return table(("process", "CPU per start, ms"), rows)


def mesh_section(router: list[Block], mesh: list[Block]) -> str:
    rows: list[list[str]] = []
    for row in ROWS:
        compared = [
            (getattr(ours, row.kind), getattr(theirs, row.kind)) for ours, theirs in zip(mesh, router, strict=True)
        ]
        cells = [" / ".join(milliseconds(times(blocks, row.kind))) for blocks in (router, mesh)]
        rows.append([row.label, *cells, ratio(compared), ratio_to_raw(mesh, row)])
    rows.append(["CPU per start, ms", f"{start_cpu(router):.1f}", f"{start_cpu(mesh):.1f}", "", ""])
    heads = ("", "router: p50 / p99, ms", "mesh: p50 / p99, ms", "mesh to router", "mesh to raw mesh")
    return f"""The same calls on two systems that take turns: the processes of one are clients of its router. Those of
the other, with `--topology mesh`, talk directly. Raw messages get faster, too, and budgets are ratios to those of the
same topology. {_how_measured(mesh)}

{table(heads, rows)}"""


def _how_measured(blocks: list[Block]) -> str:
    count = len(times(blocks, "query"))
    return f"""Each figure is of {count} calls in {len(blocks)} blocks, in turns. A ratio is the median of
the ratios of the blocks, with the least and the largest. Targets are for a load below 4. {machine()}."""


def main() -> None:
    options = make_parser(__doc__)
    options.add_argument("--topology", choices=("router", "mesh"), default="router", help="mesh: compare both")
    options.add_argument("--blocks", type=int, default=12)
    options.add_argument("--calls", type=int, default=25, help="of each kind in a block")
    given = options.parse_args()
    with ExitStack() as stack:
        stack.enter_context(own_processes())
        second = given.topology if given.topology == "mesh" else "recorded"
        systems = {
            "router": open_system(stack),
            second: open_system(stack, topology=given.topology, recorded=second == "recorded"),
        }
        actionlib, absence = (None, "") if given.topology == "mesh" else open_actionlib(stack)
        try:
            found = measure(systems, given.blocks, given.calls, actionlib)
        except PeerError as error:
            sys.exit(f"{error} Nothing was measured.")
    if given.topology == "mesh":
        body = mesh_section(found["router"], found["mesh"])
        write_section("latency.py", "Latency in a mesh", body, write=given.write, variant="--topology mesh")
        return
    body = section(found["router"], found["recorded"], absence)
    write_section("latency.py", "Latency", body, write=given.write)


if __name__ == "__main__":
    main()
