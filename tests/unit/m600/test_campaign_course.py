"""The course of a flight with real processes, some of which die."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from types import SimpleNamespace
from typing import Any, Self, cast

import pytest

from skillwing.evaluation.campaign import course
from skillwing.evaluation.campaign.result import End
from skillwing.evaluation.campaign.witness import Witness
from skillwing.services.processes.child import ProcessExit
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
def fly(monkeypatch: pytest.MonkeyPatch) -> Callable[..., course.Course]:
    def fly(*deaths: ProcessExit) -> course.Course:
        monkeypatch.setattr(LauncherOnPaper, "exits", deaths)
        monkeypatch.setattr(course, "Launcher", LauncherOnPaper)
        monkeypatch.setattr(course, "ZenohBus", BusOnPaper)
        sees: Any = SimpleNamespace(
            name="witness", over=True, end=End.HOME, map=b"", attach=lambda bus: None, ask_for_map=lambda: None
        )
        return course.over_zenoh(cast(Witness, sees), SPECS, 100.0, None)

    return fly


def test_a_death_that_a_flight_survives_is_told(fly: Callable[..., course.Course]) -> None:
    again, gone = ProcessExit("sim", 1, 1, None, (), pause=0.5), ProcessExit("recorder", 1, 1, None, ())
    survived = ("sim ended with exit code 1.", "recorder ended with exit code 1.")
    assert fly() == course.Course(End.HOME, 60.0)
    assert fly(again, gone) == course.Course(End.HOME, 60.0, deaths=survived)


def test_a_death_that_breaks_a_flight_off_is_why(fly: Callable[..., course.Course]) -> None:
    gone, again = ProcessExit("mission", 1, None, 9, ()), ProcessExit("hover", 1, 1, None, (), pause=0.5)
    told = ("hover ended with exit code 1.",)
    assert fly(again, gone) == course.Course(End.BROKE_OFF, 60.0, "mission was killed by SIGKILL.", told)
