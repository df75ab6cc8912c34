"""Recovery of the mapping mission: time from a dead camera to the grant of the first skill of the LiDAR branch.

python benchmarks/recovery.py [--flights 24] [--write]

Router, managers, mocked skills, mocked world and mission are processes of their own, on loopback. The first flight is a
warm-up and does not count.
"""

from __future__ import annotations

import sys
from contextlib import ExitStack
from pathlib import Path
from statistics import median

from checkouts import ROOT, code_of, script
from peer_process import PeerError, PeerProcess, own_processes
from performance_page import against, machine, make_parser, milliseconds, table, write_section

TARGET = 10.0
"""Target for the median [ms]."""
FLIGHT_LIMIT = 60.0
"""Longest mean time of a flight [s]."""


def open_system(stack: ExitStack, tree: Path = ROOT) -> PeerProcess:
    """A mocked m600 with its mission, by the code of a checkout. It ends with the stack."""
    return stack.enter_context(PeerProcess(script("recovery_system.py"), code_of(tree)))


def fly(system: PeerProcess, flights: int) -> tuple[list[float], float]:
    """Time of each recovery [s], and the part of it that is robot time by design [s]."""
    answer = system.ask({"flights": flights}, FLIGHT_LIMIT * flights)
    return answer["times"], answer["by_design"]


def section(times: list[float], by_design: float) -> str:
    """Section of the page. times, by_design: in seconds."""
    p50, p99 = milliseconds(times)
    row = [
        *(p50, p99),
        f"{1e3 * min(times):.2f} to {1e3 * max(times):.2f}",
        f"p50 {TARGET:g}: {against(TARGET, 1e3 * median(times))}",
        f"{1e3 * by_design:g}",
    ]
    heads = ("p50, ms", "p99, ms", "least to most, ms", "target, ms", "robot time by design, ms")
    return f"""The camera fails on a leg of the mapping mission: `zed_status` becomes `FAILED`. The time ends when
another process has seen the grant of `lidar_depthmap`, the first skill of the LiDAR branch. In between, `zed_depthmap`
ends `RI`, the mission's tree switches, and the new goal starts. Managers and mission are processes of their own, and
the skills are mocks. {len(times)} flights. The target is for a load below 4. {machine()}.

{table(heads, [row])}"""


def main() -> None:
    options = make_parser(__doc__)
    options.add_argument("--flights", type=int, default=24)
    given = options.parse_args()
    with ExitStack() as stack:
        stack.enter_context(own_processes())
        try:
            system = open_system(stack)
            fly(system, 1)
            times, by_design = fly(system, given.flights)
        except PeerError as error:
            sys.exit(f"{error} Nothing was measured.")
    write_section("recovery.py", "Recovery from a dead camera", section(times, by_design), write=given.write)


if __name__ == "__main__":
    main()
