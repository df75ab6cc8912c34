"""Signs of a fault: process exits, alive tokens, cut links and timeline records."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

from first_effects import first_effects

from cause_chains import ChainProblem, InjectedFault, bad_chains
from skillwing.dsl.model import Skillset
from skillwing.services.bus.zenoh_bus import ZenohBus
from skillwing.services.client.causal_feed import follow_records
from skillwing.services.history.history import History
from skillwing.services.processes.launcher import ROUTER, Launcher
from skillwing.services.protocol import Keys, Record, RecordKind

LOOK = 0.01
"""Wall seconds between two looks at what no message tells."""
BAD_ENDS = ("LOST", "ERROR")


class Fault(StrEnum):
    KILL = "kill -9"
    STOP = "SIGSTOP"
    HANG = "SIGSTOP for good"


@dataclass(frozen=True)
class Sign:
    """The first that was noticed of a fault: wall seconds after it, and by whom or what."""

    after: float
    by: str

    def __str__(self) -> str:
        return f"{self.after:.2f} s, {self.by}"


class Signs:
    """Does something bad to one process of a system, and watches out for who notices it."""

    def __init__(self, bus: ZenohBus, keys: Keys, launcher: Launcher) -> None:
        self.first: Sign | None = None
        self.records: list[Record] = []
        """All records, in causal order."""
        self.since = 0.0
        """Wall second of the fault."""
        self._bus = bus
        self._launcher = launcher
        self._process = ""
        self._deaths = 0
        self._alive_key = ""
        self._keys = keys
        bus.watch_alive(keys.alive("**"), self._on_alive)
        follow_records(bus, keys, self._on_record)

    @property
    def elapsed(self) -> float:
        """Wall seconds since the fault."""
        return time.monotonic() - self.since

    def harm(self, process: str, fault: Fault) -> None:
        """Kill or stop a process now."""
        self.first = None
        self._process = process
        self._alive_key = self._keys.alive(process)
        self._deaths = len(self._launcher.exits)
        pid = self._launcher.pids[process]
        self.since = time.monotonic()
        os.kill(pid, signal.SIGKILL if fault is Fault.KILL else signal.SIGSTOP)

    def kill(self) -> None:
        """Do what a person does with a process that hangs."""
        os.kill(self._launcher.pids[self._process], signal.SIGKILL)

    def wake(self) -> None:
        """Let the process that was stopped go on."""
        os.kill(self._launcher.pids[self._process], signal.SIGCONT)

    def run_until(self, done: Callable[[], bool], within: float) -> bool:
        """Take in news until a condition holds (True), or for so many wall seconds (False)."""
        deadline = time.monotonic() + within
        while not done():
            if time.monotonic() > deadline:
                return False
            self._bus.run_until(done, LOOK)
            if self.first is None and self._process:
                self._look()
        return True

    def bad_chains(self, skillset: Skillset, since: float, tolerance: float) -> tuple[str, ...]:
        """The bad cause chains of what has happened since then. A router that dies or stops may lose records."""
        fault = InjectedFault(since, first_effects(self._process, skillset))
        bad = bad_chains(History.of(self.records, skillset=skillset), skillset, fault, tolerance)
        news = (each for each in bad if each.record.t >= since)
        return tuple(str(each) for each in news if self._process != ROUTER or each.problem is not ChainProblem.CUT)

    def _look(self) -> None:
        if any(death.process == self._process for death in self._launcher.exits[self._deaths :]):
            self._note("launcher")
        elif not self._bus.connected:
            self._note("every link")

    def _on_alive(self, key: str, alive: bool) -> None:
        if key == self._alive_key and not alive:
            self._note("alive token")

    def _on_record(self, record: Record) -> None:
        self.records.append(record)
        if self._process and record.kind is RecordKind.GOAL and record.after in BAD_ENDS:
            self._note(record.source)

    def _note(self, by: str) -> None:
        if self.first is None:
            self.first = Sign(self.elapsed, by)
