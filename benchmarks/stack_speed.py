"""Speed of the whole robot on the mapping mission, with real processes on two cores, as ratio to real time.

    python benchmarks/stack_speed.py [--seed N] [--world KIND] [--seconds S] [--write]

Robot time runs as fast as all processes keep up: physics waits for guidance and obstacle detection after each step, and
no process lags by more than 0.1 s. Wall time counts, so measure on an idle machine.
"""

from __future__ import annotations

import os
import sys
import time
from itertools import pairwise
from statistics import median

from performance_page import against, machine, make_flight_parser, table, write_section

from skillwing.evaluation.flights.conditions import Condition
from skillwing.evaluation.flights.observer import FlightObserver
from skillwing.evaluation.flights.plan import FlightNetwork, FlightPlan
from skillwing.evaluation.flights.result import End
from skillwing.evaluation.flights.session import over_zenoh
from skillwing.evaluation.judged_flight import processes
from skillwing.m600.robot import ROBOT
from skillwing.onboard.topics.truth import TRUTH, Truth
from skillwing.services.bus import Bus
from skillwing.services.bus.reading import message_reader
from skillwing.services.processes.run_options import AS_FAST_AS_POSSIBLE
from skillwing.sim_mujoco.world.terrain import Terrain
from skillwing.sim_mujoco.world.world import make_world

FLOOR, TARGET = 1.0, 2.5
"""The ratio to real time that the whole stack is to keep."""
CORES = 2
BLOCK = 10.0
"""Robot seconds of which one ratio is made."""


class Stopwatch(FlightObserver):
    """A observer who looks at the clock on the wall whenever `BLOCK` seconds of robot time are over."""

    def __init__(self, terrain: Terrain) -> None:
        super().__init__(ROBOT.skillset.stem, terrain)
        self.moments: list[tuple[float, float]] = []
        """Robot time and wall time [s], from the first sight of the drone on."""

    def attach(self, bus: Bus) -> None:
        super().attach(bus)
        bus.subscribe(TRUTH, message_reader(Truth, self._look))

    def _look(self, truth: Truth) -> None:
        if not self.moments or truth.t - self.moments[-1][0] >= BLOCK:
            self.moments.append((truth.t, time.perf_counter()))

    @property
    def ratios(self) -> list[float]:
        """Robot seconds per second on the wall, block by block."""
        return [(b[0] - a[0]) / (b[1] - a[1]) for a, b in pairwise(self.moments)]


def main() -> None:
    options = make_flight_parser(__doc__).parse_args()
    cores = sorted(os.sched_getaffinity(0))[:CORES]
    os.sched_setaffinity(0, cores)
    plan = FlightPlan(
        mission="mapping", world=options.world, seed=options.seed, condition=Condition.NONE, network=FlightNetwork.ZENOH
    )
    watch = Stopwatch(make_world(plan.seed, plan.world).terrain)
    specs = processes(plan, plan.robot_options() | {"speed": AS_FAST_AS_POSSIBLE})
    course = over_zenoh(watch, specs, options.seconds, None)
    if course.end is End.BROKE_OFF:
        sys.exit(f"The flight broke off: {course.error} Nothing was measured.")
    if not watch.ratios:
        sys.exit(f"The flight was shorter than {BLOCK:g} s: there is nothing to tell. Give more --seconds.")
    (first, begun), (last, ended) = watch.moments[0], watch.moments[-1]
    whole = (last - first) / (ended - begun)
    body = (
        f"The mapping mission in the {options.world} of seed {options.seed}, by {len(specs)} processes and a router on "
        f"{len(cores)} cores. Robot time runs as fast as all keep up. The ratio is robot seconds per wall second; the "
        f"budget on {CORES} cores is {FLOOR:g}: {against(FLOOR, whole, at_least=True)}; the target is {TARGET:g}: "
        f"{against(TARGET, whole, at_least=True)}. {machine()}.\n\n"
        + table(
            ("robot time", "times real time", f"blocks of {BLOCK:g} s", "median block"),
            [
                (
                    f"{last - first:.0f} s",
                    f"{whole:.2f}",
                    f"{min(watch.ratios):.2f} to {max(watch.ratios):.2f}",
                    f"{median(watch.ratios):.2f}",
                )
            ],
        )
    )
    write_section("stack_speed.py", "The whole stack", body, write=options.write)


if __name__ == "__main__":
    main()
