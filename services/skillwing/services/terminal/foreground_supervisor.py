"""Supervision of a system in the foreground: a live table of processes, or in a pipe a line for each event."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import AbstractContextManager, ExitStack, closing
from queue import SimpleQueue
from types import TracebackType
from typing import Self

from rich.console import Console
from rich.live import Live
from rich.text import Text

from skillwing.services.access.certificate_watch import CertificateWatch
from skillwing.services.errors import SkillwingError
from skillwing.services.processes.child import ProcessExit
from skillwing.services.processes.launcher import Launcher
from skillwing.services.processes.launcher_node import LauncherNode
from skillwing.services.processes.process_monitor import ProcessMonitor, process_statuses
from skillwing.services.processes.process_state import ProcessState
from skillwing.services.processes.run_state import Announcement
from skillwing.services.processes.stop_signal import StopSignal
from skillwing.services.protocol import Keys
from skillwing.services.terminal.active_work import ActiveWork
from skillwing.services.terminal.exit_codes import FAILED
from skillwing.services.terminal.link_monitor import LinkMonitor, look_at_link
from skillwing.services.terminal.mission_reporter import MissionReporter
from skillwing.services.terminal.process_table import process_table

PERIOD = 0.5
"""Seconds between two checks of the processes; an exit is reported at once."""


class ForegroundSupervisor:
    """Supervisor of a launcher's processes: it prints their events and keeps the system's announcement up to date.

    node: the launcher's own, on the bus of this supervisor. announced: makes the context of the announcement, once this
    bus has a connection. exits: filled by the launcher. stop: ends `follow` with
    KeyboardInterrupt. reporter: of the missions of this system. active_work: goals and mission under way. objection:
    sentence against an end by Ctrl-C, or empty; a second Ctrl-C ends it all the same. certificates: reminds of their
    end. link: to the router of another system. Use it as a context manager, in which the table is shown.
    """

    def __init__(
        self,
        console: Console,
        launcher: Launcher,
        node: LauncherNode,
        announced: Callable[[], AbstractContextManager[Announcement]],
        exits: SimpleQueue[ProcessExit],
        skillset: str,
        stop: StopSignal,
        reporter: MissionReporter | None = None,
        active_work: ActiveWork | None = None,
        objection: Callable[[], str] = lambda: "",
        certificates: CertificateWatch | None = None,
        link: LinkMonitor | None = None,
    ) -> None:
        self._console = console
        self._launcher = launcher
        self._node = node
        self._announced = announced
        self._exits = exits
        self._stop = stop
        self._reporter = reporter
        self._active_work = active_work
        self._objection: Callable[[], str] | None = objection
        self._certificates = certificates
        self._link = link
        self._prefix = Keys(skillset).alive("")
        self._monitor = ProcessMonitor()
        self._alive: set[str] = set()
        self._live = Live(console=console, auto_refresh=False) if console.is_terminal else None

    def __enter__(self) -> Self:
        # A second Ctrl-C may come before this returns. Then `__exit__` is not called.
        with ExitStack() as stack:
            try:
                bus = self._launcher.open_bus(self._node.name)
            except SkillwingError:
                self._stop.check()  # a person who has stopped the system does not miss the router
                raise
            self._bus = stack.enter_context(closing(bus))
            self._node.attach(bus)
            bus.watch_alive(f"{self._prefix}**", self._on_alive)
            if self._reporter is not None:
                self._reporter.attach(bus, self._print)
            if self._active_work is not None:
                self._active_work.attach(bus, lambda: self._announce(self._launcher.states))
            # An empty message wakes the bus to look at the exits.
            self._launcher.on_change = lambda: bus.post(lambda: None)
            self._announcement = stack.enter_context(self._announced())
            if self._live is not None:
                stack.enter_context(self._live)
            self._stack = stack.pop_all()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stack.close()

    def follow(self) -> int:
        """Supervise until an essential process is given up; return the exit code for that."""
        while True:
            try:
                return self._supervise()
            except KeyboardInterrupt:
                if not self._has_objected():
                    raise

    def _has_objected(self) -> bool:
        """Object to the first Ctrl-C, if there is a reason."""
        text = self._objection() if self._stop.by_keyboard and self._objection is not None else ""
        if not text:
            return False
        self._objection = None
        self._stop.withdraw()
        self._print(f"{text} Ctrl-C again stops this system all the same.", "bold red")
        return True

    def _supervise(self) -> int:
        self._check_processes()
        while True:
            self._stop.wait(self._bus, lambda: not self._exits.empty(), PERIOD)
            while not self._exits.empty():
                ended = self._exits.get()
                if not self._node.take_exit(ended):
                    continue
                self._print(f"{ended} {ended.outlook}", "red")
                if ended.final and self._is_essential(ended.process):
                    self._print("The system cannot go on without it.", "bold red")
                    for line in ended.log:
                        self._print(f"    {line}")
                    return FAILED
            self._check_processes()

    def _on_alive(self, key: str, alive: bool) -> None:
        name = key.removeprefix(self._prefix)
        (self._alive.add if alive else self._alive.discard)(name)

    def _is_essential(self, process: str) -> bool:
        return any(state.essential for state in self._launcher.states if state.name == process)

    def _check_processes(self) -> None:
        states = self._launcher.states
        self._announce(states)
        self._launcher.shorten_logs()
        if self._link is not None and (sentence := look_at_link(self._link, self._bus, connected=self._bus.routed)):
            self._print(sentence, "bold red" if self._link.warning else "green")
        # Without a connection to the router, missing tokens mean nothing.
        statuses = process_statuses(states, self._alive if self._bus.connected else None)
        for sentence in self._monitor.changes(statuses, time.monotonic()):
            self._print(sentence, "green" if sentence.endswith("again.") else "red")
        if self._certificates is not None and (sentence := self._certificates.reminder(self._bus.router)):
            self._print(sentence, "bold red")
        if self._live is not None:
            self._live.update(process_table(statuses), refresh=True)

    def _announce(self, states: tuple[ProcessState, ...]) -> None:
        """Update the announcement, at each check and when other work begins: `down` prints the work that it ends."""
        self._announcement.update(states, "" if self._active_work is None else self._active_work.text)

    def _print(self, sentence: str, style: str = "") -> None:
        self._console.print(Text(sentence, style=style))
