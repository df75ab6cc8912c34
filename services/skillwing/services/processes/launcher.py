"""Starting a system's processes, watching them, and stopping every one of them again."""

from __future__ import annotations

import contextlib
import json
import select
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Self

from skillwing.services.bus.zenoh_bus import ZenohBus
from skillwing.services.errors import SkillwingError
from skillwing.services.processes.router import LOOPBACK
from skillwing.services.protocol import Keys
from skillwing.services.robot import ClockKind, ProcessSpec

START_TIMEOUT = 60.0
ROUTER_TIMEOUT = 15.0
STOP_TIMEOUT = 4.0
"""Seconds that processes have to end in good order before they are killed."""
LOG_LINES = 8
ROUTER = "router"


@dataclass(frozen=True, slots=True)
class Death:
    """A process that ended without being told to. Either exit_code or signal is set; log: its last lines."""

    process: str
    pid: int
    exit_code: int | None
    signal: int | None
    log: tuple[str, ...]

    def __str__(self) -> str:
        if self.signal is not None:
            return f"{self.process} was killed by {signal.Signals(self.signal).name}."
        return f"{self.process} ended with exit code {self.exit_code}."


class StartError(SkillwingError):
    """A system did not come up. missing: processes that never said they were there; deaths: those that ended."""

    def __init__(self, missing: Iterable[str], deaths: Iterable[Death], logs: dict[str, tuple[str, ...]]) -> None:
        self.missing = tuple(missing)
        self.deaths = tuple(deaths)
        told = [str(death) for death in self.deaths] or [f"No sign of life from {', '.join(self.missing)}."]
        for name, lines in logs.items():
            told.append(f"The last lines of {name}:" if lines else f"{name} has logged nothing.")
            told += [f"    {line}" for line in lines]
        super().__init__("The system did not start. " + "\n".join(told))


@dataclass
class _Child:
    name: str
    process: subprocess.Popen[bytes]
    log: Path

    def last_lines(self) -> tuple[str, ...]:
        lines = self.log.read_text(encoding="utf-8", errors="replace").splitlines()
        return tuple(lines[-LOG_LINES:])


class Launcher:
    """One system: a router and processes around it, as children of this process.

    robot: name and namespace; skillset: its name; clock: who tells robot time; run_dir: gets `logs/<process>.log`.
    on_death: called on a thread of its own when a process ends without being told to; restarting hooks in here.

    Each child holds the reading end of a pipe whose other end only this process has: when this one is killed, even
    with -9, the pipe closes and the children end. They are in sessions of their own, so that Ctrl-C in a terminal
    reaches this process alone and the children are stopped in order. Use it as a context manager.
    """

    def __init__(
        self,
        robot: str,
        skillset: str,
        run_dir: Path,
        *,
        clock: ClockKind = "robot",
        on_death: Callable[[Death], None] | None = None,
    ) -> None:
        self.robot = robot
        self.endpoint = ""
        self.run_dir = run_dir
        self.deaths: list[Death] = []
        self._keys = Keys(skillset)
        self._clock: ClockKind = clock
        self._on_death = on_death
        self._wake: Callable[[], None] = _nothing
        self._children: dict[str, _Child] = {}
        self._stopping = False

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()

    @property
    def pids(self) -> dict[str, int]:
        """Process ids of everything that was started, by name."""
        return {name: child.process.pid for name, child in self._children.items()}

    def running(self, name: str) -> bool:
        """Tell whether a process was started and has not ended."""
        child = self._children.get(name)
        return child is not None and child.process.poll() is None

    def start_router(self, listen: str = LOOPBACK) -> str:
        """Start the router and return its endpoint; raises StartError."""
        command = ["skillwing.services.processes.router", "--listen", listen, "--parent-pipe"]
        child = self._launch(ROUTER, command, stdout=subprocess.PIPE)
        assert child.process.stdout is not None
        ready, _, _ = select.select([child.process.stdout], [], [], ROUTER_TIMEOUT)
        self.endpoint = child.process.stdout.readline().decode().strip() if ready else ""
        if not self.endpoint:
            raise self._start_error([ROUTER])
        return self.endpoint

    def start(self, specs: Sequence[ProcessSpec], timeout: float = START_TIMEOUT) -> None:
        """Start processes, all at once, and return when each has said that it is there.

        Starts the router first if there is none. Raises StartError as soon as an essential one of them or the router
        ends, or when `timeout` wall seconds are over; the caller then calls `stop`. Any other that ends is not waited
        for: it is in `deaths`.
        """
        if not self.endpoint:
            self.start_router()
        missing = {self._keys.alive(spec.name): spec for spec in specs}
        bus = ZenohBus("launcher", self.robot, self.endpoint)
        self._wake = lambda: bus.post(_nothing)
        try:

            def note(key: str, alive: bool) -> None:
                if alive:
                    missing.pop(key, None)

            bus.watch_alive(self._keys.alive("**"), note)
            earlier = len(self.deaths)
            for spec in specs:
                self._launch(spec.name, self._command(spec))

            def dead() -> set[str]:
                return {death.process for death in self.deaths[earlier:]}

            def awaited() -> list[str]:
                gone = dead()
                return [spec.name for spec in missing.values() if spec.essential or spec.name not in gone]

            bus.run_until(lambda: not awaited() or not dead().isdisjoint({ROUTER, *awaited()}), timeout)
        finally:
            self._wake = _nothing
            bus.close()
        if awaited():
            raise self._start_error(awaited())

    def stop(self) -> None:
        """Stop everything: the processes, then the router. Whoever has not ended in time is killed. Idempotent."""
        self._stopping = True
        processes = [child for child in reversed(self._children.values()) if child.name != ROUTER]
        _end(processes)
        _end([child for child in self._children.values() if child.name == ROUTER])

    def _command(self, spec: ProcessSpec) -> list[str]:
        return [
            "skillwing.services.processes.node_host",
            *("--name", spec.name, "--factory", spec.factory, "--options", json.dumps(spec.options)),
            *("--connect", self.endpoint, "--robot", self.robot, "--clock", self._clock),
            *("--alive", self._keys.alive(spec.name), "--parent-pipe"),
        ]

    def _launch(self, name: str, command: list[str], stdout: int | None = None) -> _Child:
        """Start a Python module as a child and a thread that waits for its end."""
        log = self.run_dir / "logs" / f"{name}.log"
        log.parent.mkdir(parents=True, exist_ok=True)
        with log.open("ab") as file:
            process = subprocess.Popen(
                [sys.executable, "-m", *command],
                stdin=subprocess.PIPE,
                stdout=file if stdout is None else stdout,
                stderr=file,
                start_new_session=True,
            )
        child = self._children[name] = _Child(name, process, log)
        threading.Thread(target=self._watch, args=(child,), name=f"watch {name}", daemon=True).start()
        return child

    def _watch(self, child: _Child) -> None:
        code = child.process.wait()
        if self._stopping:
            return
        exit_code, number = (code, None) if code >= 0 else (None, -code)
        death = Death(child.name, child.process.pid, exit_code, number, child.last_lines())
        self.deaths.append(death)
        self._wake()
        if self._on_death is not None:
            self._on_death(death)

    def _start_error(self, missing: Iterable[str]) -> StartError:
        names = tuple(missing)
        dead = [death for death in self.deaths if death.process in (ROUTER, *names) and not self.running(death.process)]
        told = [death.process for death in dead] or names
        return StartError(names, dead, {name: self._children[name].last_lines() for name in told})


def _end(children: Sequence[_Child]) -> None:
    """Ask processes to end, and kill those that do not; also when this is interrupted."""
    deadline = time.monotonic() + STOP_TIMEOUT
    try:
        for child in children:
            child.process.terminate()
        for child in children:
            with contextlib.suppress(subprocess.TimeoutExpired):
                child.process.wait(max(0.0, deadline - time.monotonic()))
    finally:
        for child in children:
            if child.process.poll() is None:
                child.process.kill()
                child.process.wait()
            for pipe in (child.process.stdin, child.process.stdout):
                if pipe is not None:
                    pipe.close()


def _nothing() -> None:
    pass
