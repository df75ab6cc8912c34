"""Signs of a fault: process exits, alive tokens, cut links and timeline records.

The node of the launcher writes each exit into the timeline, as under `skillwing up`.
"""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum

from first_effects import first_effects

from cause_chains import ChainProblem, InjectedFault, bad_chains
from skillwing.dsl.model import Skillset
from skillwing.services.bus.zenoh_bus import ZenohBus
from skillwing.services.client.causal_feed import follow_records
from skillwing.services.history.history import History
from skillwing.services.history.wording import headline
from skillwing.services.names import KILLED, LAUNCHER, RESOURCE_MANAGER, skill_process
from skillwing.services.processes.child import ProcessExit
from skillwing.services.processes.launcher import ROUTER, Launcher
from skillwing.services.processes.launcher_node import LauncherNode
from skillwing.services.protocol import Ending, Keys, Record, RecordKind
from skillwing.services.robot import Robot

LOOK = 0.01
"""Wall seconds between two looks at what no message tells."""
TURN = 0.001
"""Wall seconds that the launcher's node has at each look to take in its messages."""
RECORD_WITHIN = 5.0
"""Wall seconds that the record of an exit has to arrive once the system is well again."""
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
    """Does something bad to one process of a system, and watches out for who notices it. Close it at the end."""

    def __init__(self, bus: ZenohBus, keys: Keys, launcher: Launcher, robot: Robot) -> None:
        self.first: Sign | None = None
        self.records: list[Record] = []
        """All records, in causal order."""
        self.since = 0.0
        """Wall second of the fault."""
        self._bus = bus
        self._launcher = launcher
        self._process = ""
        self._deaths: frozenset[ProcessExit] = frozenset()
        self._alive_key = ""
        self._killed = False
        """The process was killed, at once or by the person who found it hanging."""
        self._harmed_by_kill = False
        self._before = 0
        """Number of records from before the fault."""
        self._keys = keys
        self._launcher_bus = launcher.open_bus(LAUNCHER)
        self._launcher_node = LauncherNode(launcher, robot, keys.skillset, {})
        self._launcher_node.attach(self._launcher_bus)
        self._recorded = set(launcher.exits)
        """Number of exits that are in the timeline, or that it does not need."""
        bus.watch_alive(keys.alive("**"), self._on_alive)
        follow_records(bus, keys, self._on_record)

    def close(self) -> None:
        """End the launcher's node."""
        self._launcher_bus.close()

    @property
    def elapsed(self) -> float:
        """Wall seconds since the fault."""
        return time.monotonic() - self.since

    def harm(self, process: str, fault: Fault) -> None:
        """Kill or stop a process now."""
        self.first = None
        self._process = process
        self._alive_key = self._keys.alive(process)
        self._deaths = frozenset(self._launcher.exits)
        self._before = len(self.records)
        self._killed = self._harmed_by_kill = fault is Fault.KILL
        pid = self._launcher.pids[process]
        self.since = time.monotonic()
        os.kill(pid, signal.SIGKILL if fault is Fault.KILL else signal.SIGSTOP)

    def kill(self) -> None:
        """Do what a person does with a process that hangs."""
        self._killed = True
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
            self._record_exits()
            if self.first is None and self._process:
                self._look()
        return True

    def bad_chains(self, skillset: Skillset, since: float, tolerance: float) -> tuple[str, ...]:
        """The bad cause chains of what has happened since then. A router that dies or stops may lose records."""
        fault = InjectedFault(since, first_effects(self._process, skillset, killed=self._harmed_by_kill))
        bad = bad_chains(History.of(self.records, skillset=skillset), skillset, fault, tolerance)
        news = (each for each in bad if each.record.t >= since)
        return tuple(str(each) for each in news if self._process != ROUTER or each.problem is not ChainProblem.CUT)

    def bad_exit(self) -> tuple[str, ...]:
        """The problems with the record of the exit, if the process was killed: it has to be in the timeline.

        Goals that the resource manager has lost for that have it as their cause.
        """
        if not self._killed:
            return ()
        self.run_until(lambda: exit_of(self.records[self._before :], self._process) is not None, RECORD_WITHIN)
        return exit_problems(self.records[self._before :], self._process)

    def _record_exits(self) -> None:
        # It also follows the clock: an exit counts for grants from before it.
        self._launcher_bus.run_until(lambda: False, TURN)
        for ended in self._launcher.exits:
            if ended in self._recorded:
                continue
            self._recorded.add(ended)
            self._launcher_node.take_exit(ended)

    def _look(self) -> None:
        if any(death.process == self._process and death not in self._deaths for death in self._launcher.exits):
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


def exit_of(records: Sequence[Record], process: str) -> Record | None:
    """The launcher's record of the kill of a process."""
    own = (each for each in records if each.source == LAUNCHER)
    return next((each for each in own if (each.subject, each.after) == (process, KILLED)), None)


def exit_problems(records: Sequence[Record], process: str) -> tuple[str, ...]:
    """A sentence for a kill without a record, and for each goal that the resource manager lost for another cause.

    records: those since the kill.
    """
    exit_ = exit_of(records, process)
    if exit_ is None:
        return (f"no record says `{process} {KILLED}`",)
    ends = (each for each in records if each.source == RESOURCE_MANAGER and each.after == Ending.LOST)
    lost = (each for each in ends if skill_process(each.subject) == process)
    return tuple(f"{headline(each)} does not come of the exit" for each in lost if each.cause != exit_.id)
