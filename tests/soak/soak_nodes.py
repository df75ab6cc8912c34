"""Nodes of the soak: the owner of robot time, and a client that starts goals all day."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

from skillwing.dsl import load
from skillwing.dsl.model import Skillset
from skillwing.services.bus import Bus
from skillwing.services.bus.reading import message_reader
from skillwing.services.client.interface import GoalHandle, SkillsetInterface
from skillwing.services.history.files import TIMELINE_FILE, last_time
from skillwing.services.history.parts import part_paths
from skillwing.services.protocol import CLOCK_KEY, ClockTick, Message, encode

CLOCK_STEP = 0.15
"""Robot seconds between two ticks: less than followers extrapolate."""
COUNT_KEY = "soak/count"
COUNT_PERIOD = 0.5
"""Robot seconds between two counts."""
BEHIND = 0.5
"""Robot seconds of starts by which the client may be behind before time waits for it."""
UNRECORDED = 5.0
"""Robot seconds by which the recorder may be behind before time waits for it. It would lose events of 30 s or more."""
LOOK_PERIOD = 0.5
"""Wall seconds between two looks at what the recorder has written."""
LONGEST_HOLD = 0.2
"""Wall seconds for which time stands at most between two ticks."""


class SoakCount(Message, frozen=True, kw_only=True):
    """Goals that the client has started and seen end. succeeded: among the ended ones.

    behind: robot seconds of starts that are due and not made yet.
    """

    t: float
    started: int
    ended: int
    succeeded: int
    behind: float


class SoakClock:
    """Owner of robot time, which moves as fast as the machine starts goals and records them, and at most by `factor`.

    awaited: keys of alive tokens. Time stands until all are there. factor: most robot seconds in a wall second.
    run_dir: folder that the recorder writes.
    """

    name = "soak_clock"
    owns_clock = True

    def __init__(self, awaited: set[str], factor: float, run_dir: Path) -> None:
        self._awaited = awaited
        self._factor = factor
        self._run_dir = run_dir
        self._behind = 0.0
        self._unrecorded = 0.0

    def attach(self, bus: Bus) -> None:
        ticks = bus.advertise(CLOCK_KEY)
        bus.subscribe(COUNT_KEY, message_reader(SoakCount, self._take_count))

        def tick() -> None:
            behind = max(self._behind if self._behind > BEHIND else 0.0, self._unrecorded - UNRECORDED)
            if behind > 0.0:
                time.sleep(min(behind / self._factor, LONGEST_HOLD))  # the clock does not catch up
            ticks.put(encode(ClockTick(t=bus.now(), factor=self._factor)))

        def on_alive(key: str, alive: bool) -> None:
            if alive and key in self._awaited:
                self._awaited.discard(key)
                if not self._awaited:
                    bus.every(CLOCK_STEP, tick)

        def look() -> None:
            parts = part_paths(self._run_dir, TIMELINE_FILE)
            last = last_time(parts[-1]) if parts else None
            self._unrecorded = 0.0 if last is None else bus.now() - last
            bus.after(LOOK_PERIOD, look, wall=True)

        bus.watch_alive("**", on_alive)
        bus.after(LOOK_PERIOD, look, wall=True)

    def detach(self) -> None:
        pass

    def _take_count(self, count: SoakCount) -> None:
        self._behind = count.behind


class SoakClient:
    """Client that starts its skills in turn, at a rate for all of them together.

    A skill whose goal has not ended yet is left out in its turn. Starts that are due are made as soon as skills are
    free, also while time stands: the rate is that of the whole soak. The client publishes its count as soon as it has
    caught up, so that time goes on.
    """

    name = "soak_client"
    owns_clock = False

    def __init__(self, skillset: Skillset, skills: list[str], rate: float) -> None:
        self._skillset = skillset
        self._skills = skills
        self._rate = rate
        self._running: dict[str, GoalHandle] = {}
        self._started = self._ended = self._succeeded = self._turn = 0
        self._begun: float | None = None
        self._published_behind = 0.0
        self._starts = False

    def attach(self, bus: Bus) -> None:
        self._bus = bus
        self._interface = SkillsetInterface(bus, self._skillset, client="soak")
        self._counts = bus.advertise(COUNT_KEY)
        self._interface.on_change(self._start_due)
        bus.every(1.0 / self._rate, self._start_due)
        bus.every(COUNT_PERIOD, self._publish_count)

    def detach(self) -> None:
        self._publish_count()

    def _start_due(self) -> None:
        if self._starts or not self._interface.ready:
            return
        if self._begun is None:
            self._begun = self._bus.now()
        self._starts = True  # a start is a change, too
        try:
            for _ in range(len(self._skills)):
                if self._owed() < 1.0:
                    break
                self._start(self._skills[self._turn % len(self._skills)])
                self._turn += 1
        finally:
            self._starts = False
        if self._published_behind > BEHIND and self._owed() < 1.0:
            self._publish_count()

    def _owed(self) -> float:
        """Number of starts that are due and not made yet."""
        begun = self._bus.now() if self._begun is None else self._begun
        return (self._bus.now() - begun) * self._rate - self._started

    def _start(self, skill: str) -> None:
        before = self._running.get(skill)
        if before is not None:
            if before.terminal is None:
                return
            self._ended += 1
            self._succeeded += before.terminal.success or False
        self._running[skill] = self._interface.start(skill)
        self._started += 1

    def _publish_count(self) -> None:
        self._published_behind = max(0.0, self._owed() / self._rate)
        count = SoakCount(
            t=self._bus.now(),
            started=self._started,
            ended=self._ended,
            succeeded=self._succeeded,
            behind=self._published_behind,
        )
        self._counts.put(encode(count))


def make_clock(options: dict[str, Any]) -> SoakClock:
    """Options: `awaited`, keys of alive tokens; `factor`, most robot seconds in a wall second; `run_dir`."""
    return SoakClock(set(options["awaited"]), options["factor"], Path(options["run_dir"]))


def make_client(options: dict[str, Any]) -> SoakClient:
    """Options: `skillset`, a path; `skills`; `rate`, starts in a robot second."""
    return SoakClient(load(Path(options["skillset"])), options["skills"], options["rate"])
