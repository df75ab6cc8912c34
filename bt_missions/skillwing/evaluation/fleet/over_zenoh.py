"""Flight of two drones by real processes: a system for each robot, one router, and one simulator."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable, Mapping
from contextlib import ExitStack, closing
from pathlib import Path

from skillwing.evaluation.flights.result import End
from skillwing.evaluation.flights.session import MAP_TIMEOUT, RobotFlight, SessionEnd
from skillwing.m600.robot import ROBOT
from skillwing.services.bus.clock import FollowedClock
from skillwing.services.bus.zenoh_bus import ZenohBus
from skillwing.services.errors import TimedOutError
from skillwing.services.names import MISSION
from skillwing.services.processes.launcher import ROUTER, Launcher

TURN = 0.1
"""Wall seconds for which one observer receives before the other one does."""


class Systems:
    """The systems of all robots of a flight, as children of this process. The first one has router and simulator.

    flights: by robot; the last process of each is its mission, which starts when the processes of all robots are there.
    folder: for the logs, with a folder for each robot. Use it as a context manager; it stops all processes.
    Raises StartError and RouterUnreachableError.
    """

    def __init__(self, flights: Mapping[str, RobotFlight], folder: Path) -> None:
        self._flights = flights
        self._folder = folder
        self._stack = ExitStack()
        self._launchers: dict[str, Launcher] = {}
        self._buses: dict[str, ZenohBus] = {}
        self._cut: set[str] = set()

    def __enter__(self) -> Systems:
        with ExitStack() as started:
            started.callback(self._stack.close)
            for robot, flight in self._flights.items():
                self._start(robot, flight)
            for robot, flight in self._flights.items():
                self._launchers[robot].start(flight.specs[-1:])
            started.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    @property
    def endpoint(self) -> str:
        """Endpoint of the router."""
        return next(iter(self._launchers.values())).endpoint

    def follow(self, longest: float, patience: float, say: Callable[[str], None]) -> dict[str, SessionEnd]:
        """Wait until all robots have come to their end, and fetch their maps; at most `longest` robot seconds.

        say: gets a line for each mission that ends. Raises TimedOutError after `patience` wall seconds.
        """
        deadline, over = time.monotonic() + patience, set[str]()
        while len(over) < len(self._flights) and not self._dead() and self._now() < longest:
            if time.monotonic() > deadline:
                raise TimedOutError("The end of the flight", patience)
            self._receive()
            self._cut_links()
            for robot, flight in self._flights.items():
                if robot not in over and flight.over(self._now()):
                    over.add(robot)
                    say(f"{robot}: {flight.observer.end} at {self._now():.1f} s")
        ended = {robot: self._ended(flight) for robot, flight in self._flights.items()}
        self._fetch_maps()
        return ended

    def _start(self, robot: str, flight: RobotFlight) -> None:
        router = self.endpoint if self._launchers else None
        launcher = Launcher(
            robot, ROBOT.skillset.stem, self._folder / robot, clock=ROBOT.clock, router=router, restarts=True
        )
        self._launchers[robot] = self._stack.enter_context(launcher)
        if router is None:
            launcher.start_router()
        bus = ZenohBus(flight.observer.name, robot, launcher.endpoint, FollowedClock())
        self._buses[robot] = self._stack.enter_context(closing(bus))
        flight.observer.attach(bus)
        launcher.start(flight.specs[:-1])

    def _receive(self) -> None:
        for bus in self._buses.values():
            bus.run_until(lambda: False, TURN / len(self._buses))

    def _cut_links(self) -> None:
        """Kill each mission whose link to the ground fails now."""
        for robot, flight in self._flights.items():
            if flight.cut is not None and robot not in self._cut and self._now() >= flight.cut:
                self._cut.add(robot)
                os.kill(self._launchers[robot].pids[MISSION], signal.SIGKILL)

    def _now(self) -> float:
        return max(bus.now() for bus in self._buses.values())

    def _dead(self) -> str:
        """Sentences on essential processes that were given up."""
        found: list[str] = []
        for robot, launcher in self._launchers.items():
            essential = {ROUTER, *(spec.name for spec in self._flights[robot].specs if spec.essential)}
            essential -= {MISSION} if robot in self._cut else set()
            found += [f"{robot}: {exit_}" for exit_ in launcher.exits if exit_.final and exit_.process in essential]
        return " ".join(found)

    def _ended(self, flight: RobotFlight) -> SessionEnd:
        dead = self._dead()
        return SessionEnd(End.BROKE_OFF if dead else flight.observer.end, self._now(), dead)

    def _fetch_maps(self) -> None:
        for robot, flight in self._flights.items():
            flight.observer.ask_for_map()
            self._buses[robot].run_until(lambda observer=flight.observer: observer.map is not None, MAP_TIMEOUT)
