"""Processor time of a campaign's flight by process of the robot, all in one operating-system process.

    python benchmarks/campaign_speed.py [--seed N] [--world KIND] [--seconds S] [--write]

It is processor time and not wall time, because a machine that flies campaigns is busy.
"""

from __future__ import annotations

import time
from collections import defaultdict
from collections.abc import Callable

from performance_page import against, machine, make_flight_parser, table, write_section

from skillwing.evaluation.flights.conditions import Condition
from skillwing.evaluation.flights.observer import FlightObserver
from skillwing.evaluation.flights.plan import FlightPlan
from skillwing.evaluation.judged_flight import processes
from skillwing.m600.robot import ROBOT
from skillwing.services.bus.inprocess import InProcessBus, InProcessNetwork, Traffic
from skillwing.services.processes.in_process import RobotInProcess
from skillwing.sim_mujoco.world.world import make_world

TARGET = 7.0
"""Times real time."""
SHOWN = 0.005
"""Processes that take less than this share are told together."""


class TimedNetwork(InProcessNetwork):
    """An in-process network that knows how long each node's callbacks take, in seconds of processor time."""

    def __init__(self) -> None:
        super().__init__()
        self.times: defaultdict[str, float] = defaultdict(float)

    def send(
        self,
        source: InProcessBus,
        target: InProcessBus,
        arrive: Callable[[], None],
        traffic: Traffic = Traffic.REPLY,
        channel: object = None,
    ) -> None:
        super().send(source, target, lambda: self._time(target, arrive), traffic, channel)

    def perform(self, bus: InProcessBus, action: Callable[[], None]) -> None:
        super().perform(bus, lambda: self._time(bus, action))

    def _time(self, bus: InProcessBus, action: Callable[[], None]) -> None:
        begun = time.process_time()
        action()
        self.times[bus.name] += time.process_time() - begun


def main() -> None:
    options = make_flight_parser(__doc__).parse_args()
    plan = FlightPlan(mission="mapping", world=options.world, seed=options.seed, condition=Condition.NONE)
    terrain = make_world(plan.seed, plan.world).terrain
    network, observer = TimedNetwork(), FlightObserver(ROBOT.skillset.stem, terrain)
    with RobotInProcess(ROBOT, network) as robot:
        robot.attach(observer)
        robot.start(processes(plan, plan.robot_options()))
        network.times.clear()
        begun = time.process_time()
        network.run_until(lambda: observer.over, options.seconds)
        taken, flown = time.process_time() - begun, network.now()
    network.times["the network itself"] = taken - sum(network.times.values())
    shown = {name: spent for name, spent in network.times.items() if spent >= SHOWN * taken}
    shown[f"{len(network.times) - len(shown)} others"] = taken - sum(shown.values())
    rows = [
        (name, f"{spent:.1f} s", f"{100 * spent / taken:.0f} %", f"{1000 * spent / flown:.1f} ms")
        for name, spent in sorted(shown.items(), key=lambda item: -item[1])
    ]
    body = (
        f"The mapping mission in the {options.world} of seed {options.seed}, in one process and virtual time: "
        f"{flown:.0f} s of flight in {taken:.0f} s of processor time, {flown / taken:.1f} times real time "
        f"on one core; the target is {TARGET:g}: {against(TARGET, flown / taken, at_least=True)}. All sensors, "
        f"odometry and map run. {machine()}.\n\n"
        + table(("process", "processor time", "share", "per second of flight"), rows)
    )
    write_section("campaign_speed.py", "A campaign's flight", body, write=options.write)


if __name__ == "__main__":
    main()
