"""Launcher of a system: starts its processes, restarts those that die, and stops every one of them."""

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

from skillwing.services.access.exposure import local_endpoint
from skillwing.services.access.handshake import explained, unknown_name
from skillwing.services.access.identity_files import process_identity
from skillwing.services.bus import Topology
from skillwing.services.bus.clock import FollowedClock, WallClock, unix_offset
from skillwing.services.bus.zenoh_bus import ZenohBus
from skillwing.services.bus.zenoh_session import RouterUnreachableError, open_client
from skillwing.services.errors import SkillwingError
from skillwing.services.names import LAUNCHER
from skillwing.services.processes.checked_skillsets import pack_skillsets
from skillwing.services.processes.child import Child, ProcessExit
from skillwing.services.processes.colocation import ProcessGroup, process_groups
from skillwing.services.processes.process_state import ProcessState
from skillwing.services.processes.restart_policy import LONGEST_PAUSE
from skillwing.services.processes.router import LOOPBACK
from skillwing.services.processes.stop_signal import CHECK_PERIOD, StopSignal
from skillwing.services.protocol import Keys
from skillwing.services.robot import ClockKind, ProcessSpec

START_TIMEOUT = 60.0
ROUTER_TIMEOUT = 15.0
STOP_TIMEOUT = 4.0
"""Seconds that processes have to end in order before they are killed."""
LAST_WORDS = 1.0
"""Seconds that a router has to end after a failed start."""
ROUTER = "router"
LOGS = "logs"
"""Folder of the processes' logs, in the directory of the run."""
EXITS_KEPT = 100
"""Exits that a launcher remembers: over weeks, each mission on board is one."""


class StartError(SkillwingError):
    """A system that did not come up. missing: processes without a sign of life. exits: those that ended."""

    def __init__(self, missing: Iterable[str], exits: Iterable[ProcessExit], logs: dict[str, tuple[str, ...]]) -> None:
        self.missing = tuple(missing)
        self.exits = tuple(exits)
        text = [str(exit_) for exit_ in self.exits] or [f"No sign of life from {', '.join(self.missing)}."]
        for name, lines in logs.items():
            text.append(f"The last lines of {name}:" if lines else f"{name} has logged nothing.")
            text += [f"    {line}" for line in lines]
        super().__init__("The system did not start. " + "\n".join(text))


class Launcher:
    """One system: a router and processes around it, as children of this process.

    robot: name and namespace. skillset: its name. run_dir: directory for `logs/<process>.log`. clock: owner of robot
    time. topology: way in which processes meet, see `zenoh_session`. router: endpoint of another system's router.
    keys: folder with certificates, None without keys. insecure: strangers may reach a router without keys.
    restarts: processes that die start again as `ProcessSpec` and `RestartPolicy` say, the router at the same endpoint.
    Without it every exit is final. stop: ends a wait for processes with KeyboardInterrupt.
    on_exit: called on a thread of its own when a process ends without being told to. on_change: the same after each
    change of `states`; it may be set later.

    Each child holds the reading end of a pipe whose other end only this process has. When this process is killed, even
    with -9, the pipe closes and the children end. They run in sessions of their own, so that Ctrl-C in a terminal
    reaches this process alone, which stops them in order. Use it as a context manager.
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
        keys: Path | None = None,
        insecure: bool = False,
        restarts: bool = False,
        stop: StopSignal | None = None,
        on_exit: Callable[[ProcessExit], None] | None = None,
        on_change: Callable[[], None] | None = None,
    ) -> None:
        self.robot = robot
        self.endpoint = router or ""
        self.listens = ""
        """Address of the own router, as others reach it; empty without one."""
        self._key_folder = keys
        self._insecure = insecure
        self.run_dir = run_dir
        self.exits: list[ProcessExit] = []
        """Exits of processes, the latest `EXITS_KEPT`."""
        self._keys = Keys(skillset)
        self._clock: ClockKind = clock
        self._topology: Topology = topology
        # One offset for all lives of all processes: their common time does not jump when the machine's clock is set.
        self._unix_offset = unix_offset()
        self._restarts = restarts
        self._stop = stop or StopSignal()
        self._on_exit = on_exit or (lambda _: None)
        self.on_change = on_change or _nothing
        self._wake: Callable[[], None] = _nothing
        self._children: dict[str, Child] = {}
        self._stopping = threading.Event()
        # Held while lives begin and end, so that `stop` sees every life.
        self._lock = threading.Lock()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()

    @property
    def pids(self) -> dict[str, int]:
        """Process ids of all children, by name."""
        with self._lock:
            return {name: child.process.pid for name, child in self._children.items()}

    @property
    def states(self) -> tuple[ProcessState, ...]:
        """State of each process, in the order of their first start."""
        with self._lock:
            return tuple(child.state() for child in self._children.values())

    def shorten_logs(self) -> None:
        """Move long logs aside."""
        with self._lock:
            for child in self._children.values():
                child.shorten_log()

    def running(self, name: str) -> bool:
        """True for a process that was started and has not ended."""
        child = self._children.get(name)
        return child is not None and child.process.poll() is None

    def start_router(self, listen: str = LOOPBACK) -> str:
        """Start a router of its own and return its endpoint; raises StartError."""
        module = "skillwing.services.processes.router"
        router = ProcessGroup(ROUTER, (ProcessSpec(ROUTER, module),))
        options = ["--parent-pipe", *(("--insecure",) if self._insecure else ())]
        options += [] if self._key_folder is None else ["--keys", str(self._key_folder)]
        child = self._launch(router, [module, "--listen", listen, *options], stdout=subprocess.PIPE)
        assert child.process.stdout is not None
        self.listens = child.process.stdout.readline().decode().strip() if self._speaks(child.process.stdout) else ""
        self.endpoint = local_endpoint(self.listens)
        if not self.endpoint:
            with contextlib.suppress(subprocess.TimeoutExpired):
                child.process.wait(LAST_WORDS)
                self.exits.append(child.exited(time.monotonic()))
            raise self._start_error([ROUTER], self.exits)
        child.command = (module, "--listen", self.listens, *options)
        self._watch(child)
        return self.endpoint

    def open_bus(self, name: str) -> ZenohBus:
        """A bus of this process in robot time. Raises KeysError, RouterUnreachableError, and as `explained` says."""
        identity = None
        if self._key_folder is not None:
            identity = process_identity(self._key_folder, self.robot, LAUNCHER)
        clock = FollowedClock() if self._clock == "robot" else WallClock(offset=self._unix_offset)
        try:
            return ZenohBus(name, self.robot, self.endpoint, clock, identity=identity)
        except RouterUnreachableError as error:
            reason = explained(error, identity)
            if reason is error and self.listens:
                raise
            raise (self._no_router() if reason is error else reason) from error

    def _require_known(self, bus: ZenohBus) -> None:
        """Raise NotKnownError if the router has no rules for this robot: nobody would hear its processes."""
        if bus.is_known():
            return
        if not self.listens:
            # A zenohd says no roles, and has no token before its first robot. It takes one of a known name alone.
            with open_client(self.endpoint, self.robot, identity=bus.identity) as other:
                token = other.liveliness().declare_token(self._keys.alive(LAUNCHER))
                known = any(bus.is_known() for _ in range(2))  # the token may come after the first question
                token.undeclare()
            if known:
                return
        raise unknown_name(self.endpoint)

    def _no_router(self) -> RouterUnreachableError:
        """The error for a router of others that does not answer: this system was asked to join it."""
        keys = "" if self._key_folder is None else f" --keys {self._key_folder}"
        remedy = f"Start one there with `skillwing router --listen {self.endpoint}{keys}`"
        return RouterUnreachableError(self.endpoint, remedy)

    def start(self, specs: Sequence[ProcessSpec], timeout: float = START_TIMEOUT) -> None:
        """Start processes, all at once, and return when each of their nodes has its alive token.

        Nodes with the same host share a process. A missing router is started first. Raises StartError as soon as an
        essential process or the router ends, or after `timeout` wall seconds; the caller then calls `stop`. Raises
        NotKnownError for a router that does not know the robot.
        The start does not wait for any other process that ends: it is in `exits`.
        """
        if not self.endpoint:
            self.start_router()
        missing = {self._keys.alive(spec.name): spec for spec in specs}
        bus = self.open_bus(LAUNCHER)
        self._wake = lambda: bus.post(_nothing)
        try:
            self._require_known(bus)

            def note(key: str, alive: bool) -> None:
                if alive:
                    missing.pop(key, None)

            bus.watch_alive(self._keys.alive("**"), note)
            started = process_groups(specs)
            # The exit of a process that this start replaces may be noted only now.
            replaced = {self.pids[group.name] for group in started if group.name in self.pids}
            earlier = frozenset(self.exits)

            def exits() -> list[ProcessExit]:
                return [exit_ for exit_ in self.exits if exit_ not in earlier and exit_.pid not in replaced]

            for group in started:
                self._watch(self._launch_nodes(group))
            essential = {group.name for group in started if group.essential}

            def dead() -> set[str]:
                return {exit_.process for exit_ in exits()}

            def awaited() -> list[str]:
                gone = dead() - essential
                processes = dict.fromkeys(spec.host or spec.name for spec in missing.values())
                return [name for name in processes if name not in gone]

            self._stop.wait(bus, lambda: not awaited() or not dead().isdisjoint({ROUTER, *awaited()}), timeout)
        finally:
            self._wake = _nothing
            bus.close()
        if awaited():
            raise self._start_error(awaited(), exits())

    def launch(self, spec: ProcessSpec, log: str) -> None:
        """Start one more process and return at once; `on_exit` tells of its end. log: name of its log file.

        Raises InvalidOptionError, and OSError if the system cannot start a process.
        """
        (group,) = process_groups([spec])
        self._watch(self._launch_nodes(group, log))

    def forget(self, name: str) -> None:
        """Leave a process that has ended out of `states`."""
        with self._lock:
            if (child := self._children.pop(name, None)) is not None:
                child.kill()
        self.on_change()

    def stop(self) -> None:
        """Stop the processes, then the router. A process that does not end in time is killed. Idempotent.

        An exception meanwhile, such as that of another Ctrl-C, shortens the time: every process still ends.
        """
        self._stopping.set()
        with self._lock:
            children = list(reversed(self._children.values()))
        try:
            _end([child for child in children if child.name != ROUTER])
        finally:
            _end([child for child in children if child.name == ROUTER])

    def _speaks(self, output: IO[bytes]) -> bool:
        """Wait for the router's first output, or its end."""
        deadline = time.monotonic() + ROUTER_TIMEOUT
        while time.monotonic() < deadline:
            self._stop.check()
            if select.select([output], [], [], CHECK_PERIOD)[0]:
                return True
        return False

    def _launch_nodes(self, group: ProcessGroup, log: str | None = None) -> Child:
        """Start a host of nodes. It is told the skillsets of its options, and need not check them again."""
        nodes = [node.resolved() for node in group.nodes]
        files = (spec.options.get("skillset") for spec in nodes)
        told = pack_skillsets(file for file in files if isinstance(file, str))
        command = [*self._command(nodes), "--skillsets", str(len(told))]
        return self._launch(group, command, log=log, told=told)

    def _command(self, nodes: Iterable[ProcessSpec]) -> list[str]:
        words = ["skillwing.services.processes.node_host"]
        for spec in nodes:
            words += ["--name", spec.name, "--factory", spec.factory, "--options", json.dumps(spec.options)]
            words += ["--alive", self._keys.alive(spec.name)]
        words += ["--connect", self.endpoint, "--robot", self.robot, "--topology", self._topology]
        words += [] if self._key_folder is None else ["--keys", str(self._key_folder)]
        return [*words, "--clock", self._clock, "--unix-offset", repr(self._unix_offset), "--parent-pipe"]

    def _launch(
        self,
        group: ProcessGroup,
        command: Sequence[str],
        *,
        stdout: int | None = None,
        log: str | None = None,
        told: bytes = b"",
    ) -> Child:
        child = Child(
            group.name,
            command,
            self.run_dir / LOGS / f"{log or group.name}.log",
            restart=group.restart if self._restarts else "never",
            essential=group.essential,
            talks=group.name != ROUTER,
            nodes=tuple(spec.name for spec in group.nodes) if group.shared else (),
            told=told,
        )
        with self._lock:
            child.start(time.monotonic(), stdout)
            self._children[group.name] = child
        self.on_change()
        return child

    def _watch(self, child: Child) -> None:
        threading.Thread(target=self._restart_on_exit, args=(child,), name=f"watch {child.name}", daemon=True).start()

    def _restart_on_exit(self, child: Child) -> None:
        """Wait for the end of each life, and begin the next one if the policy allows it."""
        while True:
            child.process.wait()
            with self._lock:
                if self._stopping.is_set():
                    return
                exit_ = child.exited(time.monotonic())
                self.exits = [*self.exits[1 - EXITS_KEPT :], exit_]
            self._wake()
            self._on_exit(exit_)
            self.on_change()
            if exit_.pause is None or not self._start_again(child, exit_.pause):
                return

    def _start_again(self, child: Child, pause: float) -> bool:
        """Begin the next life after a pause, as soon as the machine has room for it. False if the system stops."""
        while not self._stopping.wait(pause):
            with self._lock:
                if self._stopping.is_set():
                    return False
                try:
                    child.start(time.monotonic())
                except OSError as error:  # no memory, or too many processes or open files
                    pause = LONGEST_PAUSE
                    child.not_started(error, pause)
                else:
                    pause = 0.0
            self.on_change()
            if not pause:
                return True
        return False

    def _start_error(self, missing: Iterable[str], exits: Iterable[ProcessExit]) -> StartError:
        names = tuple(missing)
        dead = [exit_ for exit_ in exits if exit_.process in (ROUTER, *names)]
        logs = {name: self._children[name].last_lines() for name in [exit_.process for exit_ in dead] or names}
        return StartError(names, dead, logs)


def _end(children: Sequence[Child]) -> None:
    """Ask processes to end, and kill those that do not, even after an interruption."""
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
