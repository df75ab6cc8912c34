"""Latency of skills: start, end and observed end, compared with Zenoh alone and with ROS 1.

python benchmarks/latency.py [--topology mesh] [--blocks 6] [--calls 50] [--write]

Router, managers and the peer that answers in plain Zenoh are processes of their own, on loopback. Calls of all kinds
take turns, so that other load on the machine affects all of them. With `--topology mesh` a second system, whose
processes are peers, takes turns with the first one, block by block, and the two are compared.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from queue import SimpleQueue
from statistics import median
from typing import Any

import zenoh
from latency_peers import PING, PONG, QUERY
from performance_page import against, machine, make_parser, milliseconds, ratio, table, write_section
from py_trees.behaviours import Success
from py_trees.composites import Sequence
from py_trees.decorators import FailureIsRunning

from skillwing.bt_missions.leaves.conditions import ResourceIs
from skillwing.bt_missions.leaves.context import MissionContext
from skillwing.bt_missions.leaves.skill_action import GoalPhase, SkillAction
from skillwing.bt_missions.mission.mission import Mission, MissionOptions, MissionTrees, Progress
from skillwing.bt_missions.running.runner import MissionNode
from skillwing.dsl import parse
from skillwing.services.bus import Topology
from skillwing.services.bus.zenoh_bus import ZenohBus
from skillwing.services.bus.zenoh_session import open_session
from skillwing.services.client.interface import SkillsetInterface
from skillwing.services.processes.launcher import Launcher
from skillwing.services.processes.node_host import SWITCH_INTERVAL
from skillwing.services.protocol import FireExtern, Keys, Terminal, encode
from skillwing.services.robot import Robot

STOPWATCH = """
skillset stopwatch {
    resource link { initial UP  extern UP -> DOWN  extern DOWN -> UP }
    resource arm  { initial FREE  FREE -> USED  USED -> FREE }
    skill act {
        output { at: float64 }
        effect { take: arm -> USED  release: arm -> FREE }
        precondition { free: resource=(arm == FREE)  success take }
        interrupt { apply=release }
        result { success DONE: apply=release }
    }
    skill hold {
        effect { nothing {} }
        precondition { up: resource=(link == UP) }
        invariant { link: resource=(link == UP) violation=nothing }
        interrupt { apply=nothing }
        result { success DONE: apply=nothing }
    }
}
"""
HOOKS = {"act": "latency_peers:ActHooks", "hold": "latency_peers:HoldHooks"}
PAYLOAD = bytes(226)
"""Payload of a raw query, as long as the start of a skill with some inputs."""
BUDGET = 2.5
"""Largest permitted ratio to Zenoh alone."""
TAIL_BUDGET = 10.0
"""Budget for the 99th percentile of the time to an observed violation, on an idle machine [ms]."""
PATIENCE = 10.0
ROS_GOALS = 200
ROS_PYTHON = "/usr/bin/python3"
ROS_PORT = 11377
HERE = Path(__file__).parent


@dataclass
class Block:
    """Durations of the calls, by kind [s]."""

    query: list[float] = field(default_factory=list[float])
    hop: list[float] = field(default_factory=list[float])
    dispatched: list[float] = field(default_factory=list[float])
    result: list[float] = field(default_factory=list[float])
    seen: list[float] = field(default_factory=list[float])


class Raw:
    """Plain Zenoh, the base of all comparisons."""

    def __init__(self, session: zenoh.Session) -> None:
        self._session = session
        self._ping = session.declare_publisher(PING)
        self._pongs: SimpleQueue[zenoh.Sample] = SimpleQueue()
        self._pong = session.declare_subscriber(PONG, zenoh.handlers.Callback(self._pongs.put, indirect=False))

    def query(self) -> float:
        """Time from a query to its answer [s]."""
        begun = time.monotonic()
        answers = list(self._session.get(QUERY, payload=PAYLOAD, consolidation=zenoh.ConsolidationMode.NONE))
        assert answers[0].ok is not None
        return time.monotonic() - begun

    def hop(self) -> float:
        """Duration of a publication to another process: half of the round trip [s]."""
        begun = time.monotonic()
        self._ping.put(PAYLOAD)
        self._pongs.get(timeout=PATIENCE)
        return (time.monotonic() - begun) / 2.0


class Starter:
    """A client that starts `act`, a skill that ends at once."""

    def __init__(self, bus: ZenohBus, robot: Robot) -> None:
        self._bus = bus
        self._interface = SkillsetInterface(bus, robot.load_skillset(), client="benchmark")
        assert bus.run_until(lambda: self._interface.ready, PATIENCE)

    def start(self) -> tuple[float, float]:
        """Times from the start to `on_dispatch`, and to the client's result [s]."""
        begun = time.monotonic()
        goal = self._interface.start("act")
        assert self._bus.run_until(lambda: goal.done, PATIENCE)
        ended = time.monotonic()
        assert goal.terminal is not None and goal.terminal.output is not None, goal.terminal
        return goal.terminal.output["at"] - begun, ended - begun


class Watching(Mission):
    """Mission that runs `hold` whenever the link is up, without end."""

    name = "watching"
    summary = "Runs a skill until its invariant is violated, and again when it can."

    def __init__(self) -> None:
        self.ended_at: float | None = None

    def build(self, context: MissionContext, options: Any) -> MissionTrees:
        self.leaf = SkillAction("hold", context, "hold", on_end=self._on_end)
        up = ResourceIs("link is up", context, "link", "UP", wait=1e6)
        again = FailureIsRunning("again", Sequence("watch", memory=True, children=[up, self.leaf]))
        return MissionTrees(again, Success("nothing to rescue"), Progress)

    def _on_end(self, terminal: Terminal) -> None:
        if terminal.ending == "RI":
            self.ended_at = time.monotonic()


class Watcher:
    """A mission's node, as the mission runner makes it."""

    def __init__(self, bus: ZenohBus, session: zenoh.Session, robot: Robot) -> None:
        model = robot.load_skillset()
        self._bus, self._session, self._key = bus, session, Keys(model.name).resource_extern
        self._mission = Watching()
        self._node = MissionNode(self._mission, model, MissionOptions())
        self._node.attach(bus)

    def violate(self) -> float:
        """Time from an extern transition to the tick that sees the goal's end [s]."""
        self._mission.ended_at = None
        assert self._bus.run_until(lambda: self._mission.leaf.phase is GoalPhase.RUNNING, PATIENCE), self._node.status
        begun = time.monotonic()
        self._fire("DOWN")
        assert self._bus.run_until(lambda: self._mission.ended_at is not None, PATIENCE), self._node.status
        assert self._mission.ended_at is not None
        self._fire("UP")
        return self._mission.ended_at - begun

    def _fire(self, target: str) -> None:
        request = encode(FireExtern(resource="link", target=target, source="benchmark"))
        self._session.get(self._key, zenoh.handlers.Callback(lambda _: None, indirect=False), payload=request)


@contextmanager
def running_system(folder: Path, topology: Topology) -> Iterator[tuple[Robot, str]]:
    """Run router, managers and the raw peer; yields the robot and its router's address."""
    skillset = folder / "stopwatch.skillset"
    skillset.write_text(STOPWATCH, encoding="utf-8")
    robot = Robot("benchmark", skillset, HOOKS, clock="wall")
    model = parse(STOPWATCH, skillset.name)
    with Launcher(robot.name, model.name, folder, clock="wall", topology=topology) as launcher:
        launcher.start(robot.managers({"run_dir": str(folder)}))
        command = [sys.executable, str(HERE / "latency_peers.py"), launcher.endpoint, robot.name, topology]
        with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as peer:
            assert peer.stdout is not None and peer.stdin is not None
            assert peer.stdout.readline() == b"ready\n"
            yield robot, launcher.endpoint
            peer.stdin.close()


class Stand:
    """A system of one topology, with its measuring clients."""

    def __init__(self, topology: Topology, stack: ExitStack) -> None:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        robot, endpoint = stack.enter_context(running_system(folder, topology))
        buses = [ZenohBus(name, robot.name, endpoint, topology=topology) for name in ("starter", "watcher")]
        for bus in buses:
            stack.callback(bus.close)
        session = stack.enter_context(open_session(topology, endpoint, robot.name))
        self._raw, self._starter = Raw(session), Starter(buses[0], robot)
        self._watcher = Watcher(buses[1], session, robot)

    def measure(self, calls: int) -> Block:
        block = Block()
        for _ in range(calls):
            block.query.append(self._raw.query())
            dispatched, result = self._starter.start()
            block.dispatched.append(dispatched)
            block.result.append(result)
            block.hop.append(self._raw.hop())
            block.seen.append(self._watcher.violate())
        return block


def measure(topologies: Iterable[Topology], blocks: int, calls: int) -> dict[Topology, list[Block]]:
    """Blocks of calls on a system of each topology, in turns. The first block is a warm-up and does not count."""
    sys.setswitchinterval(SWITCH_INTERVAL)
    os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, [str(HERE), os.environ.get("PYTHONPATH")]))
    with ExitStack() as stack:
        stands: dict[Topology, Stand] = {topology: Stand(topology, stack) for topology in topologies}
        measured: dict[Topology, list[Block]] = {topology: [] for topology in stands}
        for number in range(blocks + 1):
            for topology, stand in stands.items():
                block = stand.measure(calls)
                if number > 0:
                    measured[topology].append(block)
        return measured


def measure_ros() -> list[float]:
    """Durations of goals of actionlib; none if ROS 1 is not installed [s]."""
    if shutil.which("roscore") is None or not Path(ROS_PYTHON).exists():
        return []
    environment = {**os.environ, "ROS_MASTER_URI": f"http://127.0.0.1:{ROS_PORT}", "ROS_IP": "127.0.0.1"}
    environment.pop("PYTHONPATH", None)
    peer = [ROS_PYTHON, str(HERE / "ros_peer.py")]
    with ExitStack() as stack:
        environment["ROS_HOME"] = stack.enter_context(tempfile.TemporaryDirectory())

        def start(command: list[str]) -> subprocess.Popen[bytes]:
            process = subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
            stack.callback(process.wait)
            stack.callback(process.terminate)
            return process

        start(["roscore", "-p", str(ROS_PORT)])
        server = start([*peer, "server"])
        assert server.stdout is not None
        # Other lines come before the master is up.
        assert b"ready\n" in iter(server.stdout.readline, b""), "the action server did not start"
        client = start([*peer, "client", str(ROS_GOALS)])
        told, _ = client.communicate(timeout=120)
        return [float(line) for line in told.split()]


ROWS = (
    ("raw Zenoh: query and answer", "query", "", ""),
    ("raw Zenoh: one publication", "hop", "", ""),
    ("start of a skill, until `on_dispatch`", "dispatched", "query", "queries"),
    ("start of a skill, until its result", "result", "query", ""),
    ("extern transition, until the mission's tree has seen `RI`", "seen", "hop", "publications"),
)
"""Measured quantities: label, field of `Block`, field of the base, and unit of the budget."""


def times(blocks: list[Block], kind: str) -> list[float]:
    return [each for block in blocks for each in getattr(block, kind)]


def times_raw(blocks: list[Block], kind: str, base: str) -> str:
    return ratio([(getattr(block, kind), getattr(block, base)) for block in blocks]) if base else ""


def against_budget(blocks: list[Block], kind: str, base: str, limit: str) -> str:
    if not limit:
        return ""
    return f"{BUDGET:g} {limit}: {against(BUDGET, median(times(blocks, kind)) / median(times(blocks, base)))}"


def section(blocks: list[Block], ros: list[float]) -> str:
    rows = [
        [
            name,
            *milliseconds(times(blocks, kind)),
            times_raw(blocks, kind, base),
            against_budget(blocks, kind, base, limit),
        ]
        for name, kind, base, limit in ROWS
    ]
    worst = milliseconds(times(blocks, "seen"))[1]
    rows[-1][-1] += f"; p99 {TAIL_BUDGET:g} ms on an idle machine: {against(TAIL_BUDGET, float(worst))}"
    if ros:
        rows.append(["rospy + actionlib: start of an action, until its result", *milliseconds(ros), "", ""])
    absent = "" if ros else " ROS 1 is not installed here."
    return f"""Router, managers, client and mission are processes of their own on one machine; the journal is on, and
raw messages are as long as ours. {_how_measured(blocks)}{absent}

{table(("", "p50, ms", "p99, ms", "ratio (blocks)", "budget"), rows)}"""


def mesh_section(router: list[Block], mesh: list[Block]) -> str:
    rows: list[list[str]] = []
    for name, kind, base, limit in ROWS:
        pairs = [(getattr(ours, kind), getattr(theirs, kind)) for ours, theirs in zip(mesh, router, strict=True)]
        rows.append(
            [
                name,
                " / ".join(milliseconds(times(router, kind))),
                " / ".join(milliseconds(times(mesh, kind))),
                ratio(pairs),
                times_raw(mesh, kind, base),
                against_budget(mesh, kind, base, limit),
            ]
        )
    heads = ("", "router: p50 / p99, ms", "mesh: p50 / p99, ms", "mesh to router", "mesh to raw mesh", "budget")
    return f"""The same calls on two systems that take turns block by block: the processes of one are clients of its
router, those of the other, with `--topology mesh`, talk directly. Raw messages get faster by that, too, and budgets
are ratios to those of the same topology. {_how_measured(mesh)}

{table(heads, rows)}"""


def _how_measured(blocks: list[Block]) -> str:
    count = sum(len(block.query) for block in blocks)
    return f"""Each figure is of {count} calls that took turns in {len(blocks)} blocks; the ratio is
followed by its least and largest value among the blocks. {machine()}."""


def main() -> None:
    options = make_parser(__doc__)
    options.add_argument("--topology", choices=("router", "mesh"), default="router", help="mesh: compare both")
    options.add_argument("--blocks", type=int, default=6)
    options.add_argument("--calls", type=int, default=50, help="of each kind in a block")
    given = options.parse_args()
    if given.topology == "mesh":
        found = measure(("router", "mesh"), given.blocks, given.calls)
        body = mesh_section(found["router"], found["mesh"])
        write_section("latency.py", "Latency in a mesh", body, write=given.write, variant="--topology mesh")
        return
    body = section(measure(("router",), given.blocks, given.calls)["router"], measure_ros())
    write_section("latency.py", "Latency", body, write=given.write)


if __name__ == "__main__":
    main()
