"""Flight of two drones by real processes: a system for each drone and for the yard, one router, one simulator."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable
from contextlib import ExitStack, closing
from pathlib import Path

from skillwing.evaluation.fleet.session import FleetFlight
from skillwing.evaluation.fleet.yard import YARD, yard_table
from skillwing.evaluation.flights.observer import FlightObserver
from skillwing.evaluation.flights.result import End
from skillwing.evaluation.flights.session import MAP_TIMEOUT, SessionEnd
from skillwing.m600.robot import ROBOT
from skillwing.services.bus.clock import FollowedClock
from skillwing.services.bus.zenoh_bus import ZenohBus
from skillwing.services.errors import TimedOutError
from skillwing.services.names import MISSION
from skillwing.services.processes.launcher import ROUTER, Launcher
from skillwing.services.robot import Robot

TURN = 0.1
"""Wall seconds for which one observer receives before the other one does."""


class Systems:
    """The systems of all robots of a flight, as children of this process. The first drone has router and simulator.

    The missions start when the processes of all robots are there. A process that is killed comes back by its launcher,
    but a mission. folder: for the logs, with a folder for each robot. Use it as a context manager; it stops all
    processes. Raises StartError and RouterUnreachableError.
    """

    def __init__(self, flight: FleetFlight, folder: Path) -> None:
        self._flight = flight
        self._folder = folder
        self._stack = ExitStack()
        self._launchers: dict[str, Launcher] = {}
        self._buses: dict[str, ZenohBus] = {}
        self._killed = False

    def __enter__(self) -> Systems:
        with ExitStack() as started:
            started.callback(self._stack.close)
            for name, drone in self._flight.drones.items():
                launcher = self._launcher(name, ROBOT)
                self._observe(name, drone.observer)
                launcher.start(drone.specs)
            yard = self._launcher(YARD, yard_table())
            self._flight.witness.attach(next(iter(self._buses.values())))
            yard.start(self._flight.yard)
            for name, mission in self._flight.missions.items():
                self._launchers[name].start([mission])
            started.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    @property
    def endpoint(self) -> str:
        """Endpoint of the router."""
        return self._launchers[self._first].endpoint

    def follow(self, longest: float, patience: float, say: Callable[[str], None]) -> dict[str, SessionEnd]:
        """Wait until all drones have come to their end, and fetch their maps; at most `longest` robot seconds.

        say: gets a line for each drone, and for a process that is killed. Raises TimedOutError after `patience` wall
        seconds.
        """
        deadline = time.monotonic() + patience
        while not self._flight.over(self._now()) and not self._dead() and self._now() < longest:
            if time.monotonic() > deadline:
                raise TimedOutError("The end of the flight", patience)
            self._receive()
            self._kill(say)
        ended = {name: self._ended(drone.observer) for name, drone in self._flight.drones.items()}
        for name, session in ended.items():
            say(f"{name}: {session.end} at {session.end_time:.1f} s")
        self._fetch_maps()
        return ended

    @property
    def _first(self) -> str:
        return next(iter(self._flight.drones))

    def _launcher(self, name: str, table: Robot) -> Launcher:
        router = self.endpoint if self._launchers else None
        folder = self._folder / name
        launcher = Launcher(name, table.skillset.stem, folder, clock=table.clock, router=router, restarts=True)
        self._launchers[name] = self._stack.enter_context(launcher)
        if router is None:
            launcher.start_router()
        return launcher

    def _observe(self, name: str, observer: FlightObserver) -> None:
        bus = ZenohBus(observer.name, name, self.endpoint, FollowedClock())
        self._buses[name] = self._stack.enter_context(closing(bus))
        observer.attach(bus)

    def _receive(self) -> None:
        for bus in self._buses.values():
            bus.run_until(lambda: False, TURN / len(self._buses))

    def _kill(self, say: Callable[[str], None]) -> None:
        """Kill the process of the plan when its time has come."""
        kill = self._flight.kill
        if kill is None or self._killed or self._now() < kill.t:
            return
        self._killed = True
        self._flight.witness.note_kill()
        os.kill(self._launchers[kill.robot].pids[kill.process], signal.SIGKILL)
        say(f"{kill.robot}: {kill.process} was killed at {self._now():.1f} s")

    def _now(self) -> float:
        return max(bus.now() for bus in self._buses.values())

    def _dead(self) -> str:
        """Sentences on essential processes that were given up, and on a mission that has crashed."""
        found: list[str] = []
        for name, launcher in self._launchers.items():
            specs = self._flight.yard if name == YARD else self._flight.drones[name].specs
            essential = {ROUTER, *(spec.name for spec in specs if spec.essential)}
            if not (self._killed and self._flight.loses_mission(name)):
                essential.add(MISSION)
            given_up = [each for each in launcher.exits if each.final and each.process in essential]
            found += [f"{name}: {each}" for each in given_up if each.exit_code != 0]
        return " ".join(found)

    def _ended(self, observer: FlightObserver) -> SessionEnd:
        dead = self._dead()
        return SessionEnd(End.BROKE_OFF if dead else observer.end, self._now(), dead)

    def _fetch_maps(self) -> None:
        for name, drone in self._flight.drones.items():
            drone.observer.ask_for_map()
            self._buses[name].run_until(lambda observer=drone.observer: observer.map is not None, MAP_TIMEOUT)
