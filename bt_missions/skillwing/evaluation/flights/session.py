"""Session of a flight on either network, from the start of its processes until the observer has the end."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from skillwing.evaluation.flights.observer import FlightObserver
from skillwing.evaluation.flights.result import End
from skillwing.m600.robot import ROBOT
from skillwing.services.bus.clock import FollowedClock
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.bus.zenoh_bus import ZenohBus
from skillwing.services.errors import SkillwingError, TimedOutError
from skillwing.services.processes.in_process import RobotInProcess
from skillwing.services.processes.launcher import ROUTER, Launcher
from skillwing.services.robot import ProcessSpec

LAST_WORDS = 3.0
"""Robot seconds after the end, for the last records and the map."""
MAP_TIMEOUT = 10.0
"""Wall seconds that the map may take over Zenoh."""
LONGEST_WALL = 3000.0
"""Wall seconds after which real processes are taken for hung."""


@dataclass(frozen=True, slots=True)
class SessionEnd:
    """End of a session and its time [robot s].

    error: reason why it broke off, empty otherwise. deaths: sentences about processes that died and were started again
    or not needed.
    """

    end: End
    end_time: float
    error: str = ""
    deaths: tuple[str, ...] = ()


def in_process(observer: FlightObserver, specs: Sequence[ProcessSpec], longest: float) -> SessionEnd:
    """Host all processes here, in virtual time; whatever goes wrong in a node breaks the flight off."""
    network = InProcessNetwork()
    with RobotInProcess(ROBOT, network) as robot:

        def start() -> None:
            robot.attach(observer)
            robot.start(specs)

        return followed(network, {ROBOT.name: observer}, start, lambda: observer.over, longest)[ROBOT.name]


def followed(
    network: InProcessNetwork,
    observers: Mapping[str, FlightObserver],
    start: Callable[[], None],
    over: Callable[[], bool],
    longest: float,
) -> dict[str, SessionEnd]:
    """Ends of the flights of all robots on a network in virtual time, which go on for at most `longest` s.

    observers: by robot; at the end each asks for its map. An exception in any node breaks all flights off.
    """
    try:
        start()
        network.run_until(over, longest)
        ended = {robot: SessionEnd(observer.end, network.now()) for robot, observer in observers.items()}
        for observer in observers.values():
            observer.ask_for_map()
        network.run_for(LAST_WORDS)
    except Exception as failure:  # noqa: BLE001 - a campaign goes on, whatever a node does
        why = f"{type(failure).__name__}: {failure}"
        return {robot: SessionEnd(End.BROKE_OFF, network.now(), why) for robot in observers}
    return ended


def over_zenoh(
    observer: FlightObserver, specs: Sequence[ProcessSpec], longest: float, folder: Path | None
) -> SessionEnd:
    """Start real processes around a router, as `skillwing demo` does; the mission, last of them, when all are there.

    folder: gets their logs, None for nowhere. Raises TimedOutError where they seem to hang: a slow machine's clock on
    the wall says nothing of the flight.
    """
    *robot, mission = specs
    with tempfile.TemporaryDirectory() as nowhere:
        launcher = Launcher(ROBOT.name, ROBOT.skillset.stem, folder or Path(nowhere), clock=ROBOT.clock, restarts=True)
        essential = {ROUTER, *(spec.name for spec in specs if spec.essential)}

        def deaths(*, fatal: bool) -> tuple[str, ...]:
            found = launcher.exits
            return tuple(str(each) for each in found if (each.final and each.process in essential) is fatal)

        def dead() -> str:
            return " ".join(deaths(fatal=True))

        with launcher:
            try:
                launcher.start_router()
                with closing(ZenohBus(observer.name, ROBOT.name, launcher.endpoint, FollowedClock())) as bus:
                    observer.attach(bus)
                    launcher.start(robot)
                    launcher.start([mission])
                    over = bus.run_until(lambda: observer.over or bool(dead()) or bus.now() > longest, LONGEST_WALL)
                    if not over:
                        raise TimedOutError("The end of the flight", LONGEST_WALL)
                    end = End.BROKE_OFF if dead() else observer.end
                    ended = SessionEnd(end, bus.now(), dead(), deaths(fatal=False))
                    observer.ask_for_map()
                    bus.run_until(lambda: observer.map is not None, MAP_TIMEOUT)
            except TimedOutError:
                raise
            except (SkillwingError, OSError) as failure:
                return SessionEnd(End.BROKE_OFF, 0.0, str(failure), deaths(fatal=False))
    return ended
