"""Staying with a running system: one table of its processes on a terminal, a line for each event in a pipe."""

from __future__ import annotations

import time
from contextlib import ExitStack, closing
from queue import SimpleQueue
from types import TracebackType
from typing import Self

from rich.console import Console
from rich.live import Live
from rich.text import Text

from skillwing.services.bus.zenoh_bus import ZenohBus
from skillwing.services.processes.launcher import Death, Launcher
from skillwing.services.processes.process_monitor import Entry, RollCall, entries_of
from skillwing.services.processes.process_state import ProcessState
from skillwing.services.processes.run_state import Announcement
from skillwing.services.processes.stop_signal import Ending
from skillwing.services.protocol import Keys
from skillwing.services.terminal.active_work import Unfinished
from skillwing.services.terminal.exit_codes import FAILED
from skillwing.services.terminal.mission_reporter import FlightReports
from skillwing.services.terminal.process_table import process_table

PERIOD = 0.5
"""Seconds between two looks at the processes; a death is told at once."""


class Attendance:
    """Watches a launcher's processes, tells what happens to them, and makes it known to other commands.

    deaths: filled by the launcher; ending: when to stop with KeyboardInterrupt; reports: of the missions that are flown
    meanwhile; unfinished: what is under way. To be used as a context manager, in which the table is shown.
    """

    def __init__(
        self,
        console: Console,
        launcher: Launcher,
        announcement: Announcement,
        deaths: SimpleQueue[Death],
        skillset: str,
        ending: Ending,
        reports: FlightReports | None = None,
        unfinished: Unfinished | None = None,
    ) -> None:
        self._console = console
        self._launcher = launcher
        self._announcement = announcement
        self._deaths = deaths
        self._ending = ending
        self._reports = reports
        self._unfinished = unfinished
        self._prefix = Keys(skillset).alive("")
        self._roll_call = RollCall()
        self._alive: set[str] = set()
        self._live = Live(console=console, auto_refresh=False) if console.is_terminal else None

    def __enter__(self) -> Self:
        # A second Ctrl-C may come while this is under way, and then nobody calls `__exit__`.
        with ExitStack() as undoing:
            self._bus = undoing.enter_context(
                closing(ZenohBus("attendance", self._launcher.robot, self._launcher.endpoint))
            )
            self._bus.watch_alive(f"{self._prefix}**", self._on_alive)
            if self._reports is not None:
                self._reports.attach(self._bus, self._tell)
            if self._unfinished is not None:
                self._unfinished.attach(self._bus, lambda: self._announce(self._launcher.states))
            self._launcher.on_change = lambda: self._bus.post(_nothing)
            if self._live is not None:
                undoing.enter_context(self._live)
            self._undoing = undoing.pop_all()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._undoing.close()

    def follow(self) -> int:
        """Stay until a process is given up without which the system cannot go on; returns the exit code of that."""
        self._look()
        while True:
            self._ending.wait(self._bus, lambda: not self._deaths.empty(), PERIOD)
            while not self._deaths.empty():
                death = self._deaths.get()
                self._tell(f"{death} {death.outlook}", "red")
                if death.final and self._is_essential(death.process):
                    self._tell("The system cannot go on without it.", "bold red")
                    for line in death.log:
                        self._tell(f"    {line}")
                    return FAILED
            self._look()

    def _on_alive(self, key: str, alive: bool) -> None:
        name = key.removeprefix(self._prefix)
        (self._alive.add if alive else self._alive.discard)(name)

    def _is_essential(self, process: str) -> bool:
        return any(state.essential for state in self._launcher.states if state.name == process)

    def _look(self) -> None:
        states = self._launcher.states
        self._announce(states)
        # Cut off from the router, nobody's silence means anything.
        alive = self._alive if self._bus.connected else None
        entries = entries_of(states, alive)
        for sentence in self._roll_call.look(entries, time.monotonic()):
            self._tell(sentence, "green" if sentence.endswith("again.") else "red")
        self._show(entries)

    def _announce(self, states: tuple[ProcessState, ...]) -> None:
        """Also between two looks, when other things are under way: `down` tells of those when it ends the system."""
        self._announcement.update(states, "" if self._unfinished is None else self._unfinished.words)

    def _tell(self, sentence: str, style: str = "") -> None:
        self._console.print(Text(sentence, style=style))

    def _show(self, entries: list[Entry]) -> None:
        if self._live is not None:
            self._live.update(process_table(entries), refresh=True)


def _nothing() -> None:
    """What a bus finds in its mailbox that has to look at the deaths."""
