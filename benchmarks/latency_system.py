"""One system that `latency.py` measures: router, managers, and the measured processes, all of one checkout.

latency.py starts it: latency_system.py router|mesh [recorder]
A question names a role and a number of calls. The answer has their times, and the processor time of each process. With
a recorder it also has the number of publications.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

from checkouts import script
from peer_process import PeerProcess, serve

from skillwing.dsl import parse
from skillwing.services.bus import Topology
from skillwing.services.processes.launcher import Launcher
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
RECORDER = "recorder"
QUIET = 0.2
"""Wall time after a block in which its last publications arrive [s]."""
CALL_LIMIT = 5.0
"""Longest mean time of a call [s]."""


@contextmanager
def running_system(
    topology: Topology, *, recorded: bool = False
) -> Iterator[tuple[dict[str, PeerProcess], dict[str, int]]]:
    """A system: its measured processes by role, and the pids of all that take part in a call."""
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        skillset = folder / "stopwatch.skillset"
        skillset.write_text(STOPWATCH, encoding="utf-8")
        robot = Robot("benchmark", skillset, HOOKS, clock="wall")
        name = parse(STOPWATCH, skillset.name).name
        launcher = stack.enter_context(Launcher(robot.name, name, folder, clock="wall", topology=topology))
        launcher.start(robot.managers({"run_dir": str(folder)}))
        place = (launcher.endpoint, robot.name, topology)
        stack.enter_context(PeerProcess(script("latency_peers.py", *place, name)))
        roles = {
            "raw": script("latency_clients.py", "raw", *place, str(skillset)),
            "client": script("latency_clients.py", "client", *place, str(skillset)),
            "mission": script("latency_mission.py", *place, str(skillset)),
        }
        if recorded:
            roles[RECORDER] = script("latency_recorder.py", *place, name)
        peers = {role: stack.enter_context(PeerProcess(command)) for role, command in roles.items()}
        yield peers, {**launcher.pids, **{role: peer.pid for role, peer in peers.items()}}


def processor_times(pids: Mapping[str, int]) -> dict[str, float]:
    """User and system time of each process so far, with threads that have ended [s].

    /proc counts it in steps of 10 ms, which is several starts. The processor clock of a process counts nanoseconds; its
    id is that of `man 3 clock_getcpuclockid`.
    """
    return {name: time.clock_gettime(~pid << 3 | 2) for name, pid in pids.items()}


def main() -> None:
    """Let one process at a time measure, until standard input ends."""
    topology: Topology = "mesh" if sys.argv[1] == "mesh" else "router"
    recorded = RECORDER in sys.argv[2:]
    with running_system(topology, recorded=recorded) as (peers, pids):

        def received() -> int:
            time.sleep(QUIET)
            return 0 if not recorded else peers[RECORDER].ask({}, CALL_LIMIT)["received"]

        def measure(question: dict[str, Any]) -> dict[str, Any]:
            calls = question["calls"]
            published, before = received(), processor_times(pids)
            times = peers[question["role"]].ask({"calls": calls}, CALL_LIMIT * calls)
            after = processor_times(pids)
            used = {name: after[name] - before[name] for name in pids}
            return {"times": times, "cpu": used, "publications": received() - published}

        serve(measure)


if __name__ == "__main__":
    main()
