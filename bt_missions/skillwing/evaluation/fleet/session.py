"""Session of two drones and the yard in this process and in virtual time."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import partial

from skillwing.evaluation.fleet.plan import Kill
from skillwing.evaluation.fleet.yard import YARD, YardWitness, yard_table
from skillwing.evaluation.flights.observer import FlightObserver
from skillwing.evaluation.flights.result import End
from skillwing.evaluation.flights.session import SessionEnd, followed
from skillwing.m600.robot import ROBOT
from skillwing.services.bus.inprocess import InProcessNetwork, SentMessage
from skillwing.services.processes.in_process import RobotInProcess
from skillwing.services.robot import ProcessSpec


@dataclass(frozen=True, slots=True)
class DroneFlight:
    """The part of one drone in a flight: its observer and its processes."""

    observer: FlightObserver
    specs: Sequence[ProcessSpec]


@dataclass(frozen=True, slots=True)
class FleetFlight:
    """All parts of a flight. drones: by name; the first one has the simulator. yard: the processes of the yard.
    witness: of the places. missions: by drone; they start last. kill: what is killed meanwhile."""

    drones: Mapping[str, DroneFlight]
    yard: Sequence[ProcessSpec]
    witness: YardWitness
    missions: Mapping[str, ProcessSpec]
    kill: Kill | None

    def loses_mission(self, drone: str) -> bool:
        """True if the mission of a drone is killed."""
        return self.kill is not None and self.kill.ends_mission_of(drone)

    def over(self, now: float) -> bool:
        """True if each mission is over, or killed, and both drones have come to their end."""
        return all(self._over(name, drone.observer, now) for name, drone in self.drones.items())

    def _over(self, name: str, observer: FlightObserver, now: float) -> bool:
        kill = self.kill
        killed = kill is not None and kill.ends_mission_of(name) and now > kill.t
        return observer.over or (killed and observer.end is not End.FLYING)


def together(
    flight: FleetFlight, longest: float, tap: Callable[[SentMessage], None] | None = None
) -> dict[str, SessionEnd]:
    """Host all processes of all robots here, on one network in virtual time, as `followed` does.

    tap: receives every message.
    """
    network = InProcessNetwork()
    network.tap = tap
    robots = {name: RobotInProcess(replace(ROBOT, name=name), network) for name in flight.drones}
    robots[YARD] = RobotInProcess(yard_table(), network)

    def start() -> None:
        for name, drone in flight.drones.items():
            robots[name].attach(drone.observer)
            robots[name].start(drone.specs)
        robots[YARD].attach(flight.witness)
        robots[YARD].start(flight.yard)
        for name, mission in flight.missions.items():
            robots[name].start((mission,))
        if flight.kill is not None:
            network.schedule(flight.kill.t, flight.witness.note_kill)
            _schedule(network, robots[flight.kill.robot], flight.kill, flight.yard)

    observers = {name: drone.observer for name, drone in flight.drones.items()}
    with ExitStack() as stack:
        for robot in robots.values():
            stack.enter_context(robot)
        return followed(network, observers, start, lambda: flight.over(network.now()), longest)


def _schedule(network: InProcessNetwork, robot: RobotInProcess, kill: Kill, specs: Sequence[ProcessSpec]) -> None:
    network.schedule(kill.t, partial(robot.kill, kill.process))
    if kill.back_after is not None:
        again = [spec for spec in specs if spec.name == kill.process]
        network.schedule(kill.t + kill.back_after, partial(robot.start, again))
