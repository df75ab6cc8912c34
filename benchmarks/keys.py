"""Cost of keys: a question and a start through a router with TLS and rules, against one without, in turns.

python benchmarks/keys.py [--rounds 20] [--calls 50] [--write]

Two systems of mocks run at once, and one process asks both, so that a busy moment of the machine hits both.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path
from statistics import median, quantiles

from performance_page import machine, make_parser, table, write_section

from skillwing.services.access.identity_files import read_identity
from skillwing.services.access.key_store import KeyStore
from skillwing.services.access.robots import robot_access
from skillwing.services.bus import Answer
from skillwing.services.bus.identity import owned_chunk
from skillwing.services.bus.zenoh_bus import ZenohBus
from skillwing.services.client.interface import SkillsetInterface
from skillwing.services.mocking.system import mock_processes
from skillwing.services.processes.launcher import Launcher
from skillwing.services.processes.router import LOOPBACK, LOOPBACK_WITH_KEYS
from skillwing.services.protocol import QueryStates, encode
from skillwing.services.robot import Robot
from skillwing.services.wire.channel import Role

SKILLSET = """\
skillset bench {
    resource arm { initial FREE  FREE -> USED  USED -> FREE }
    skill act {
        effect { take: arm -> USED  release: arm -> FREE }
        precondition { free: resource=(arm == FREE)  success take }
        interrupt { apply=release }
        result { success DONE: apply=release }
    }
}
"""
SCRIPT = "[skill.act]\ndelay = 0.0\n"
TIMEOUT = 10.0
LAYOUTS = ("without keys", "with keys")


class System:
    """A running system of mocks, and a client of it."""

    def __init__(self, bus: ZenohBus, interface: SkillsetInterface) -> None:
        self._bus = bus
        self._interface = interface
        self._key = "bench/resource/state"

    def ask(self) -> float:
        """Seconds from a question to the resource manager until its answer."""
        answers: list[Answer] = []
        begun = time.perf_counter()
        self._bus.ask(self._key, encode(QueryStates()), answers.append)
        if not self._bus.run_until(lambda: bool(answers), TIMEOUT):
            raise TimeoutError("the resource manager did not answer")
        return time.perf_counter() - begun

    def start(self) -> float:
        """Seconds from a start until the goal has ended, with a skill that takes no time."""
        begun = time.perf_counter()
        goal = self._interface.start("act", {})
        if not self._bus.run_until(lambda: goal.done, TIMEOUT):
            raise TimeoutError("the goal did not end")
        elapsed = time.perf_counter() - begun
        if goal.terminal is None or not goal.terminal.success:
            raise RuntimeError(f"the goal ended otherwise: {goal.terminal}")
        return elapsed


@contextmanager
def running(folder: Path, *, keys: bool) -> Iterator[System]:
    """A system in a folder of its own."""
    skillset, script = folder / "bench.skillset", folder / "bench.mock.toml"
    skillset.write_text(SKILLSET, encoding="utf-8")
    script.write_text(SCRIPT, encoding="utf-8")
    robot = Robot("bench", skillset, {}, clock="wall")
    store, identity = None, None
    if keys:
        store = KeyStore.init(folder / "keys", [])
        store.add_robot(robot_access(robot))
        identity = read_identity(store.add_person("alice", Role.CLIENT))
    with Launcher("bench", "bench", folder, clock="wall", keys=store and store.folder) as launcher:
        launcher.start_router(LOOPBACK_WITH_KEYS if keys else LOOPBACK)
        launcher.start(mock_processes(robot, scripts=[script], run={"run_dir": str(folder)}))
        name = "client" if identity is None else owned_chunk(identity.name, "client")
        with closing(ZenohBus(name, "bench", launcher.endpoint, identity=identity)) as bus:
            interface = SkillsetInterface(bus, robot.load_skillset(), client="client")
            if not bus.run_until(lambda: interface.ready, TIMEOUT):
                raise TimeoutError("the resource manager did not answer")
            yield System(bus, interface)


def measure(rounds: int, calls: int) -> dict[str, dict[str, list[float]]]:
    """Times of each kind of call by layout [s]. The layouts take turns, and the first one alternates."""
    with ExitStack() as stack:
        systems = {
            name: stack.enter_context(
                running(Path(stack.enter_context(tempfile.TemporaryDirectory())), keys=name == LAYOUTS[1])
            )
            for name in LAYOUTS
        }
        times: dict[str, dict[str, list[float]]] = {kind: {name: [] for name in LAYOUTS} for kind in ("query", "start")}
        for turn in range(rounds + 1):
            for name in LAYOUTS if turn % 2 else LAYOUTS[::-1]:
                actions: dict[str, Callable[[], float]] = {"query": systems[name].ask, "start": systems[name].start}
                for kind, action in actions.items():
                    taken = [action() for _ in range(calls)]
                    times[kind][name] += taken if turn else []  # the first turn warms up
        return times


def section(times: dict[str, dict[str, list[float]]]) -> str:
    """The section of docs/performance.md."""
    words = {"query": "question to the resource manager", "start": "start of a skill until it has ended"}
    rows: list[list[str]] = []
    for kind, by_layout in times.items():
        middle = {name: median(taken) for name, taken in by_layout.items()}
        for name, taken in by_layout.items():
            p99 = quantiles(taken, n=100)[-1]
            ratio = middle[name] / middle[LAYOUTS[0]]
            rows.append([words[kind], name, f"{middle[name] * 1e3:.2f}", f"{p99 * 1e3:.2f}", f"{ratio:.2f}"])
    count = len(times["query"][LAYOUTS[0]])
    heads = ("call", "layout", "median, ms", "99 %, ms", "ratio of medians")
    return f"""Mutual TLS and the rules of [keys](keys.md), against a router on loopback without them. {count} calls
of each kind and layout, in turns, on mocks. {machine()}.

{table(heads, rows)}"""


def main() -> None:
    """Measure, print and write."""
    options = make_parser(__doc__)
    options.add_argument("--rounds", type=int, default=20, help="turns of each layout")
    options.add_argument("--calls", type=int, default=50, help="calls of each kind in a turn")
    given = options.parse_args()
    write_section("keys.py", "Keys", section(measure(given.rounds, given.calls)), write=given.write)


if __name__ == "__main__":
    main()
