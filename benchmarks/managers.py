"""All managers of the m600 as they stand idle beside its simulator: their start-up, processor time and memory.

python benchmarks/managers.py [--seconds 20] [--write]
"""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

from performance_page import against, machine, make_parser, table, tell

from skillwing.m600.robot import ROBOT
from skillwing.services.bus.clock import FollowedClock
from skillwing.services.bus.zenoh_bus import ZenohBus
from skillwing.services.processes.launcher import ROUTER, Launcher
from skillwing.services.processes.proc_files import usage

SETTLE = 5.0
"""Wall seconds between the start of everything and the measurement."""


def _used(pids: dict[str, int]) -> dict[str, tuple[float, int]]:
    """Processor seconds so far and resident bytes of each process that lives."""
    found = {name: usage(pid) for name, pid in pids.items()}
    return {name: (each.cpu, each.memory) for name, each in found.items() if each is not None}


def _robot_time(launcher: Launcher) -> float:
    clock = FollowedClock()
    bus = ZenohBus("benchmark", ROBOT.name, launcher.endpoint, clock)
    bus.run_until(clock.has_started, SETTLE)
    bus.close()
    return clock.now()


def main() -> None:
    options = make_parser(__doc__)
    options.add_argument("--seconds", type=float, default=20.0, help="how long to watch the idle managers")
    given = options.parse_args()
    specs = ROBOT.managers()
    with tempfile.TemporaryDirectory() as folder:
        model = ROBOT.load_skillset()
        with Launcher(ROBOT.name, model.name, Path(folder), clock=ROBOT.clock) as launcher:
            launcher.start(ROBOT.functional_layer({}))
            begun = time.monotonic()
            launcher.start(specs)
            started = time.monotonic() - begun
            time.sleep(SETTLE)
            pids = {name: pid for name, pid in launcher.pids.items() if name in {ROUTER, *(s.name for s in specs)}}
            before, robot_before, begun = _used(pids), _robot_time(launcher), time.monotonic()
            time.sleep(given.seconds)
            after, watched = _used(pids), time.monotonic() - begun
            pace = (_robot_time(launcher) - robot_before) / watched
    shares = {name: 100.0 * (after[name][0] - before[name][0]) / watched for name in after}
    managers = {name: share for name, share in shares.items() if name != ROUTER}
    used = sum(managers.values())
    rows = [[f"`{name}`", f"{share:.2f}", f"{after[name][1] / 2**20:.0f}"] for name, share in shares.items()]
    largest = max(memory for _, memory in after.values()) / 2**20
    body = f"""The {len(specs)} managers of the m600 were all there {started:.2f} s after their start, beside a running
simulator. Idle for {watched:.0f} s they used together **{used:.1f} % of one core**
(budget of 5 %: {against(5.0, used)}), the largest
of them {largest:.0f} MB (budget of 60 MB: {against(60.0, largest)}; most of it is shared code).
Robot time ran at {pace:.2f} times real time. {machine()}.

{table(("process", "% of a core", "resident MB"), rows)}"""
    tell("managers.py", "Idle managers", body, write=given.write)


if __name__ == "__main__":
    main()
