"""A flight's session with real processes, some of which die."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from types import SimpleNamespace
from typing import Any, Self, cast

import pytest

from skillwing.evaluation.flights import session
from skillwing.evaluation.flights.observer import FlightObserver
from skillwing.evaluation.flights.result import End
from skillwing.services.processes.launcher import ProcessExit
from skillwing.services.robot import ProcessSpec

SPECS = [
    ProcessSpec("sim", "", essential=True),
    ProcessSpec("hover", "", essential=False),
    ProcessSpec("recorder", "", essential=False),
    ProcessSpec("mission", "", essential=True),
]


class LauncherOnPaper:
    """Starts nothing, and says who died."""

    endpoint = ""
    exits: Sequence[ProcessExit] = ()

    def __init__(self, *arguments: object, **options: object) -> None:
        pass

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        pass

    def start_router(self) -> None:
        pass

    def start(self, specs: Sequence[ProcessSpec]) -> None:
        pass


class BusOnPaper:
    def __init__(self, *arguments: object) -> None:
        pass

    def run_until(self, done: Callable[[], bool], timeout: float) -> bool:
        return done()

    def now(self) -> float:
        return 60.0

    def close(self) -> None:
        pass


@pytest.fixture
def fly(monkeypatch: pytest.MonkeyPatch) -> Callable[..., session.SessionEnd]:
    def fly(*deaths: ProcessExit) -> session.SessionEnd:
        monkeypatch.setattr(LauncherOnPaper, "exits", deaths)
        monkeypatch.setattr(session, "Launcher", LauncherOnPaper)
        monkeypatch.setattr(session, "ZenohBus", BusOnPaper)
        sees: Any = SimpleNamespace(
            name="observer", over=True, end=End.HOME, map=b"", attach=lambda bus: None, ask_for_map=lambda: None
        )
        return session.over_zenoh(cast(FlightObserver, sees), SPECS, 100.0, None)

    return fly


def test_a_process_exit_that_a_flight_survives_is_reported(fly: Callable[..., session.SessionEnd]) -> None:
    again, gone = ProcessExit("sim", 1, 1, None, (), pause=0.5), ProcessExit("recorder", 1, 1, None, ())
    survived = ("sim ended with exit code 1.", "recorder ended with exit code 1.")
    assert fly() == session.SessionEnd(End.HOME, 60.0)
    assert fly(again, gone) == session.SessionEnd(End.HOME, 60.0, deaths=survived)


def test_a_death_that_breaks_a_flight_off_is_why(fly: Callable[..., session.SessionEnd]) -> None:
    gone, again = ProcessExit("mission", 1, None, 9, ()), ProcessExit("hover", 1, 1, None, (), pause=0.5)
    told = ("hover ended with exit code 1.",)
    assert fly(again, gone) == session.SessionEnd(End.BROKE_OFF, 60.0, "mission was killed by SIGKILL.", told)
