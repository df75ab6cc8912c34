"""Load of idle managers: processor time, robot time and real time of the same interval."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

from benchmark_scripts import script

script("performance_page")
managers = script("managers")

PIDS = {managers.ROUTER: 1, "resource_manager": 2}
PACE, SHARE = 0.5, 0.03
OPENING = 2.0
"""Seconds until a session is open, and again until it has heard the robot's time."""


class World:
    """The time of a robot that runs at half of real time. Each of its processes uses 3 % of a core."""

    def __init__(self) -> None:
        self.t = 0.0

    def monotonic(self) -> float:
        return self.t

    def sleep(self, seconds: float) -> None:
        self.t += seconds

    def usage(self, pid: int) -> SimpleNamespace:
        del pid
        return SimpleNamespace(cpu=SHARE * self.t)

    def clock(self) -> SimpleNamespace:
        return SimpleNamespace(now=lambda: PACE * self.t, has_started=lambda: True)

    def session(self, *_: Any) -> SimpleNamespace:
        self.sleep(OPENING)
        return SimpleNamespace(run_until=self._run_until, close=lambda: None)

    def _run_until(self, done: Callable[[], bool], timeout: float) -> None:
        self.sleep(OPENING if done() else timeout)

    def launcher(self, *_: Any, **__: Any) -> Launcher:
        return Launcher()


class Launcher:
    """A system whose processes run."""

    endpoint = "tcp/127.0.0.1:1"
    pids = PIDS

    def __enter__(self) -> Launcher:
        return self

    def __exit__(self, *_: object) -> None: ...

    def start(self, specs: object) -> None: ...


@pytest.fixture(autouse=True)
def world(monkeypatch: pytest.MonkeyPatch) -> World:
    world = World()
    monkeypatch.setattr(managers, "time", world)
    monkeypatch.setattr(managers, "usage", world.usage)
    monkeypatch.setattr(managers, "_memory", lambda pid: (50.0, 10.0))
    monkeypatch.setattr(managers, "FollowedClock", world.clock)
    monkeypatch.setattr(managers, "ZenohBus", world.session)
    monkeypatch.setattr(managers, "Launcher", world.launcher)
    return world


def test_time_in_which_a_session_opens_is_in_no_figure() -> None:
    layout = managers.watch("a process each", 20.0)
    assert (layout.watched, layout.pace) == pytest.approx((20.0, PACE))
    assert [each.cpu for each in (layout.router, *layout.managers.values())] == pytest.approx([100.0 * SHARE] * 2)
