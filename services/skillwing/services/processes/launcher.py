"""Starting a system's processes, starting again what dies, and stopping every one of them."""

from __future__ import annotations

import contextlib
import json
import select
import subprocess
import threading
import time
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from types import TracebackType
from typing import IO, Self

from skillwing.services.bus import Topology
from skillwing.services.bus.clock import unix_offset
from skillwing.services.bus.zenoh_bus import ZenohBus
from skillwing.services.errors import SkillwingError
from skillwing.services.processes.child import Child, Death
from skillwing.services.processes.colocation import Household, households
from skillwing.services.processes.process_state import ProcessState
from skillwing.services.processes.router import LOOPBACK
from skillwing.services.processes.stop_signal import LOOK_PERIOD, Ending
from skillwing.services.protocol import Keys
from skillwing.services.robot import ClockKind, ProcessSpec

__all__ = ["ROUTER", "Death", "Launcher", "StartError"]

START_TIMEOUT = 60.0
ROUTER_TIMEOUT = 15.0
STOP_TIMEOUT = 4.0
"""Seconds that processes have to end in good order before they are killed."""
LAST_WORDS = 1.0
"""Seconds that a router which could not start has to end."""
ROUTER = "router"


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


class Launcher:
    """One system: a router and processes around it, as children of this process.

    router: the endpoint of one that runs already, where systems of other robots may be, too; else it has its own.

    robot: name and namespace; skillset: its name; clock: who tells robot time; run_dir: gets `logs/<process>.log`;
    topology: how the processes meet, see `zenoh_session`.
    restarts: what dies is started again as its `ProcessSpec` and `RestartPolicy` say, the router at the same endpoint;
    else every death is final. on_death: called on a thread of its own when a process ends without being told to;
    on_change: the same, whenever `states` has changed; it may be set later. ending: ends the wait for whoever starts,
    with KeyboardInterrupt.

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
        topology: Topology = "router",
        router: str | None = None,
        restarts: bool = False,
        ending: Ending | None = None,
        on_death: Callable[[Death], None] | None = None,
        on_change: Callable[[], None] | None = None,
    ) -> None:
        self.robot = robot
        self.endpoint = router or ""
        self.run_dir = run_dir
        self.deaths: list[Death] = []
        self._keys = Keys(skillset)
        self._clock: ClockKind = clock
        self._topology: Topology = topology
        # One for all lives of all processes: the time they share does not jump when the machine's clock is set.
        self._unix_offset = unix_offset()
        self._restarts = restarts
        self._ending = ending or Ending()
        self._on_death = on_death or _ignore
        self.on_change = on_change or _nothing
        self._wake: Callable[[], None] = _nothing
        self._children: dict[str, Child] = {}
        self._stopping = threading.Event()
        # Held while lives begin and end, so that none begins that `stop` does not know of.
        self._lock = threading.Lock()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()

    @property
    def pids(self) -> dict[str, int]:
        """Process ids of everything that was started, by name."""
        with self._lock:
            return {name: child.process.pid for name, child in self._children.items()}

    @property
    def states(self) -> tuple[ProcessState, ...]:
        """What has become of each process, in the order in which they were started first."""
        with self._lock:
            return tuple(child.state() for child in self._children.values())

    def running(self, name: str) -> bool:
        """Tell whether a process was started and has not ended."""
        child = self._children.get(name)
        return child is not None and child.process.poll() is None

    def start_router(self, listen: str = LOOPBACK) -> str:
        """Start a router of its own and return its endpoint; raises StartError."""
        module = "skillwing.services.processes.router"
        router = Household(ROUTER, (ProcessSpec(ROUTER, module),))
        child = self._launch(router, [module, "--listen", listen, "--parent-pipe"], stdout=subprocess.PIPE)
        assert child.process.stdout is not None
        self.endpoint = child.process.stdout.readline().decode().strip() if self._speaks(child.process.stdout) else ""
        if not self.endpoint:
            with contextlib.suppress(subprocess.TimeoutExpired):
                child.process.wait(LAST_WORDS)
                self.deaths.append(child.died(time.monotonic()))
            raise self._start_error([ROUTER], self.deaths)
        child.command = (module, "--listen", self.endpoint, "--parent-pipe")
        self._look_after(child)
        return self.endpoint

    def start(self, specs: Sequence[ProcessSpec], timeout: float = START_TIMEOUT) -> None:
        """Start processes, all at once, and return when each of their nodes has said that it is there.

        Nodes with the same host share a process. Starts the router first if there is none. Raises StartError as soon as
        an essential process or the router ends, or when `timeout` wall seconds are over; the caller then calls `stop`.
        Any other that ends is not waited for: it is in `deaths`.
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
            started = households(specs)
            for household in started:
                self._look_after(self._launch(household, self._command(household)))
            indispensable = {household.name for household in started if household.essential}

            def dead() -> set[str]:
                return {death.process for death in self.deaths[earlier:]}

            def awaited() -> list[str]:
                gone = dead() - indispensable
                processes = dict.fromkeys(spec.host or spec.name for spec in missing.values())
                return [name for name in processes if name not in gone]

            self._ending.wait(bus, lambda: not awaited() or not dead().isdisjoint({ROUTER, *awaited()}), timeout)
        finally:
            self._wake = _nothing
            bus.close()
        if awaited():
            raise self._start_error(awaited(), self.deaths[earlier:])

    def stop(self) -> None:
        """Stop everything: the processes, then the router. Whoever has not ended in time is killed. Idempotent.

        An exception on the way, such as that of another Ctrl-C, cuts the time short and not the end of anyone.
        """
        self._stopping.set()
        with self._lock:
            children = list(reversed(self._children.values()))
        try:
            _end([child for child in children if child.name != ROUTER])
        finally:
            _end([child for child in children if child.name == ROUTER])

    def _speaks(self, output: IO[bytes]) -> bool:
        """Wait until the router says something, or ends."""
        deadline = time.monotonic() + ROUTER_TIMEOUT
        while time.monotonic() < deadline:
            self._ending.look()
            if select.select([output], [], [], LOOK_PERIOD)[0]:
                return True
        return False

    def _command(self, household: Household) -> list[str]:
        words = ["skillwing.services.processes.node_host"]
        for spec in household.nodes:
            words += ["--name", spec.name, "--factory", spec.factory, "--options", json.dumps(spec.options)]
            words += ["--alive", self._keys.alive(spec.name)]
        words += ["--connect", self.endpoint, "--robot", self.robot, "--topology", self._topology]
        return [*words, "--clock", self._clock, "--unix-offset", repr(self._unix_offset), "--parent-pipe"]

    def _launch(self, household: Household, command: Sequence[str], stdout: int | None = None) -> Child:
        child = Child(
            household.name,
            command,
            self.run_dir / "logs" / f"{household.name}.log",
            restart=household.restart if self._restarts else "never",
            essential=household.essential,
            talks=household.name != ROUTER,
            nodes=tuple(spec.name for spec in household.nodes) if household.shared else (),
        )
        with self._lock:
            child.start(time.monotonic(), stdout)
            self._children[household.name] = child
        self.on_change()
        return child

    def _look_after(self, child: Child) -> None:
        threading.Thread(target=self._live_on, args=(child,), name=f"watch {child.name}", daemon=True).start()

    def _live_on(self, child: Child) -> None:
        """Wait for the end of each life, and begin the next one while there is to be one."""
        while True:
            child.process.wait()
            with self._lock:
                if self._stopping.is_set():
                    return
                death = child.died(time.monotonic())
                self.deaths.append(death)
            self._wake()
            self._on_death(death)
            self.on_change()
            if death.pause is None or self._stopping.wait(death.pause):
                return
            with self._lock:
                if self._stopping.is_set():
                    return
                child.start(time.monotonic())
            self.on_change()

    def _start_error(self, missing: Iterable[str], deaths: Iterable[Death]) -> StartError:
        names = tuple(missing)
        dead = [death for death in deaths if death.process in (ROUTER, *names)]
        told = [death.process for death in dead] or names
        return StartError(names, dead, {name: self._children[name].last_lines() for name in told})


def _end(children: Sequence[Child]) -> None:
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
            child.kill()


def _nothing() -> None:
    pass


def _ignore(death: Death) -> None:
    del death
