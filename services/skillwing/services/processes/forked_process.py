"""Client of the fork server, and the processes that it forks: with what a launcher needs of `subprocess.Popen`.

A forked process is a child of the fork server, which reports its exit code. All launchers of this process share one
server. It ends with this process.
"""

from __future__ import annotations

import atexit
import os
import select
import signal
import socket
import subprocess
import sys
import threading
import weakref
from collections.abc import Mapping, Sequence
from contextlib import ExitStack, suppress
from functools import cache
from pathlib import Path
from typing import IO, Protocol

import msgspec

from skillwing.services.processes.fork_server import HOST, PID, SIZE, STATUS, Order

SERVER = "skillwing.services.processes.fork_server"
PATIENCE = 20.0
"""Longest wait for a fork [s]. The first one waits for the imports of the server."""
EXIT_UNKNOWN = 255
"""Exit code of a process whose fork server has died before it, or hangs: nobody else can see its own."""
REPORT_PATIENCE = 1.0
"""Longest wait for the exit code of a process that has ended [s]."""
SERVER_LOST = "The fork server has ended. The process starts without it."


class Process(Protocol):
    """A child of a launcher. returncode: None while it runs; minus the number of the signal that has killed it."""

    @property
    def pid(self) -> int: ...
    @property
    def returncode(self) -> int | None: ...
    @property
    def stdin(self) -> IO[bytes] | None: ...
    @property
    def stdout(self) -> IO[bytes] | None: ...
    def poll(self) -> int | None: ...
    def wait(self, timeout: float | None = None) -> int: ...
    def terminate(self) -> None: ...
    def kill(self) -> None: ...


class ForkedProcess:
    """A process that the fork server has forked. stdin: the other end of its standard input. Any thread may wait."""

    stdout = None

    def __init__(self, title: str, pid: int, process: int, report: int, stdin: IO[bytes]) -> None:
        self.pid = pid
        self.returncode: int | None = None
        self.stdin = stdin
        self._title = title
        self._process = process
        self._report = report
        self._lock = threading.Lock()
        weakref.finalize(self, _close, process, report)

    def poll(self) -> int | None:
        """The exit code; None while the process runs."""
        return self._ended(0.0)

    def wait(self, timeout: float | None = None) -> int:
        """Wait for its end; returns its exit code. Raises subprocess.TimeoutExpired after `timeout` seconds."""
        code = self._ended(timeout)
        if code is None:
            raise subprocess.TimeoutExpired(self._title, timeout or 0.0)
        return code

    def terminate(self) -> None:
        self._signal(signal.SIGTERM)

    def kill(self) -> None:
        self._signal(signal.SIGKILL)

    def _signal(self, number: signal.Signals) -> None:
        with suppress(ProcessLookupError):  # it has ended
            signal.pidfd_send_signal(self._process, number)

    def _ended(self, timeout: float | None) -> int | None:
        if not _readable(self._process, timeout):
            return None
        with self._lock:
            if self.returncode is None:
                # A server that lives reports at once. The pipe of one that is dead is at its end.
                status = os.read(self._report, STATUS.size) if _readable(self._report, REPORT_PATIENCE) else b""
                self.returncode = os.waitstatus_to_exitcode(*STATUS.unpack(status)) if status else EXIT_UNKNOWN
            return self.returncode


class ForkServer:
    """A fork server of this process, and the place and variables of Python at its start.

    Its forks have the same ones: the search path of modules is made of them.
    """

    def __init__(self, environment: Mapping[str, str]) -> None:
        ours, theirs = socket.socketpair()
        with theirs:
            self._process = subprocess.Popen(
                [sys.executable, "-m", SERVER],
                stdin=theirs.fileno(),
                stdout=subprocess.DEVNULL,
                env=environment,
                start_new_session=True,
            )
        self.pid = self._process.pid
        self._link = ours
        self._link.settimeout(PATIENCE)
        self._origin = _origin(environment)

    def fits(self, environment: Mapping[str, str]) -> bool:
        """True for a server that lives, and finds the same modules as a new process with this environment."""
        return self._process.poll() is None and self._origin == _origin(environment)

    def fork(self, arguments: Sequence[str], environment: Mapping[str, str], log: int) -> ForkedProcess:
        """Fork a host of nodes. log: descriptor for its output. Raises OSError if the server cannot do that."""
        title = " ".join([sys.executable, "-m", HOST, *arguments])
        order = msgspec.msgpack.encode(Order(list(arguments), dict(environment), title))
        with ExitStack() as closing, ExitStack() as on_failure:
            stdin, told = os.pipe()
            closing.callback(os.close, stdin)
            told_file = on_failure.enter_context(os.fdopen(told, "wb"))
            report, reported = os.pipe()
            closing.callback(os.close, reported)
            on_failure.callback(os.close, report)
            socket.send_fds(self._link, [SIZE.pack(len(order))], [stdin, log, log, reported])
            self._link.sendall(order)
            answer, processes, _, _ = socket.recv_fds(self._link, PID.size, 1)
            if not processes:
                raise BlockingIOError("The system has no room for another process.") if answer else OSError(SERVER_LOST)
            on_failure.pop_all()
        (pid,) = PID.unpack(answer)
        return ForkedProcess(title, pid, processes[0], report, told_file)

    def close(self) -> None:
        """End the server. Its forks go on."""
        self._link.close()
        self._process.kill()
        self._process.wait()


class SharedForkServer:
    """The fork server of all launchers of this process."""

    def __init__(self) -> None:
        self.server: ForkServer | None = None
        self._lock = threading.Lock()

    def fork(
        self, arguments: Sequence[str], environment: Mapping[str, str], log: int, *, start_server: bool
    ) -> ForkedProcess | None:
        """A forked host of nodes; None if there is no fork server and none can be started.

        start_server: start one if there is none, or none that fits.
        """
        with self._lock:
            try:
                if self.server is not None and not self.server.fits(environment):
                    self.close()
                if self.server is None:
                    if not start_server or not _has_descriptors():
                        return None
                    self.server = ForkServer(environment)
                return self.server.fork(arguments, environment, log)
            except OSError:
                self.close()
                return None

    def close(self) -> None:
        """End the server, if there is one."""
        if self.server is not None:
            self.server.close()
            self.server = None


SHARED = SharedForkServer()
atexit.register(SHARED.close)


@cache
def _has_descriptors() -> bool:
    """True where processes have descriptors: not before Linux 5.3, and not in each sandbox."""
    try:
        os.close(os.pidfd_open(os.getpid()))
    except (AttributeError, OSError):
        return False
    return True


def _origin(environment: Mapping[str, str]) -> tuple[Path, dict[str, str]]:
    """The place and variables by which Python finds modules. Raises OSError if the folder is gone."""
    return Path.cwd(), {name: value for name, value in environment.items() if name.startswith("PYTHON")}


def _readable(descriptor: int, timeout: float | None) -> bool:
    """Wait until a descriptor is readable, for `timeout` seconds at most, without end for None."""
    ready = select.poll()
    ready.register(descriptor, select.POLLIN)
    return bool(ready.poll(None if timeout is None else 1000.0 * timeout))


def _close(*descriptors: int) -> None:
    for descriptor in descriptors:
        os.close(descriptor)
