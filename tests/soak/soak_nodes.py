"""Nodes of the soak: the owner of robot time, and a client that starts goals all day."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from skillwing.dsl import load
from skillwing.dsl.model import Skillset
from skillwing.services.bus import Bus
from skillwing.services.client.interface import GoalHandle, SkillsetInterface
from skillwing.services.protocol import CLOCK_KEY, ClockTick, Message, encode

CLOCK_STEP = 0.15
"""Robot seconds between two ticks: less than followers extrapolate."""
COUNT_KEY = "soak/count"
COUNT_PERIOD = 60.0
"""Robot seconds between two counts."""


class SoakCount(Message, frozen=True, kw_only=True):
    """Goals that the client has started and seen end. succeeded: among the ended ones."""

    t: float
    started: int
    ended: int
    succeeded: int


class SoakClock:
    """Owner of robot time, which moves faster than wall time.

    awaited: keys of alive tokens. Time stands until all are there. factor: robot seconds in a wall second.
    """

    name = "soak_clock"
    owns_clock = True

    def __init__(self, awaited: set[str], factor: float) -> None:
        self._awaited = awaited
        self._factor = factor

    def attach(self, bus: Bus) -> None:
        ticks = bus.advertise(CLOCK_KEY)

        def tick() -> None:
            ticks.put(encode(ClockTick(t=bus.now(), factor=self._factor)))

        def on_alive(key: str, alive: bool) -> None:
            if alive and key in self._awaited:
                self._awaited.discard(key)
                if not self._awaited:
                    bus.every(CLOCK_STEP, tick)

        bus.watch_alive("**", on_alive)

    def detach(self) -> None:
        pass


class SoakClient:
    """Client that starts each of its skills in turn, at a rate for all of them together.

    A skill whose goal has not ended yet is left out in its turn.
    """

    name = "soak_client"
    owns_clock = False

    def __init__(self, skillset: Skillset, skills: list[str], rate: float) -> None:
        self._skillset = skillset
        self._skills = skills
        self._rate = rate
        self._running: dict[str, GoalHandle] = {}
        self._started = self._ended = self._succeeded = self._turn = 0

    def attach(self, bus: Bus) -> None:
        self._bus = bus
        self._interface = SkillsetInterface(bus, self._skillset, client="soak")
        self._counts = bus.advertise(COUNT_KEY)
        bus.every(1.0 / self._rate, self._start_next)
        bus.every(COUNT_PERIOD, self._publish_count)

    def detach(self) -> None:
        self._publish_count()

    def _start_next(self) -> None:
        if not self._interface.ready:
            return
        skill = self._skills[self._turn % len(self._skills)]
        self._turn += 1
        before = self._running.get(skill)
        if before is not None:
            if before.terminal is None:
                return
            self._ended += 1
            self._succeeded += before.terminal.success or False
        self._running[skill] = self._interface.start(skill)
        self._started += 1

    def _publish_count(self) -> None:
        count = SoakCount(t=self._bus.now(), started=self._started, ended=self._ended, succeeded=self._succeeded)
        self._counts.put(encode(count))


def make_clock(options: dict[str, Any]) -> SoakClock:
    """Options: `awaited`, keys of alive tokens; `factor`, robot seconds in a wall second."""
    return SoakClock(set(options["awaited"]), options["factor"])


def make_client(options: dict[str, Any]) -> SoakClient:
    """Options: `skillset`, a path; `skills`; `rate`, starts in a robot second."""
    return SoakClient(load(Path(options["skillset"])), options["skills"], options["rate"])
