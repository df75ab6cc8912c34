"""Processes of a benchmark that answer a line of JSON with a line of JSON, each within a time limit.

No process stays behind. A peer ends when its standard input ends, so also when its parent was killed. `own_processes`
marks the environment of all that starts in it, and at its end ends by pid every process with this mark.
"""

from __future__ import annotations

import json
import os
import select
import signal
import subprocess
import sys
import time
import uuid
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from types import FrameType
from typing import Any, Self

import psutil

MARK = "SKILLWING_BENCHMARK_"
START_LIMIT = 90.0
"""Longest time until a peer has answered for the first time [s]."""
END_LIMIT = 10.0
"""Longest time that a process has to end after a request, before it is killed [s]."""


class PeerError(Exception):
    """A peer that ended, or did not answer in time."""


class PeerProcess:
    """A child process that answers questions. Use it as a context manager.

    environment: variables to add to those of this process, or to remove (None).
    """

    def __init__(
        self, command: Sequence[str], environment: Mapping[str, str | None] | None = None, limit: float = START_LIMIT
    ) -> None:
        changed = {**os.environ, **(environment or {})}
        self._name = " ".join(command[1:3])
        self._received = b""
        self._process = subprocess.Popen(
            command,
            env={name: value for name, value in changed.items() if value is not None},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            start_new_session=True,
        )
        try:
            self.greeting = self.receive(limit)
        except BaseException:
            self.close(0.0)
            raise

    @property
    def pid(self) -> int:
        return self._process.pid

    def ask(self, question: Mapping[str, Any], limit: float) -> dict[str, Any]:
        """Send a question and wait for its answer. Raises PeerError."""
        self.send(question)
        return self.receive(limit)

    def send(self, question: Mapping[str, Any]) -> None:
        """Send a question. Raises PeerError if the process has ended."""
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(json.dumps(question).encode() + b"\n")
            self._process.stdin.flush()
        except OSError as error:
            raise PeerError(f"`{self._name}` has ended.") from error

    def receive(self, limit: float) -> dict[str, Any]:
        """The next answer. Other lines of output are skipped. Raises PeerError after `limit` seconds."""
        until = time.monotonic() + limit
        while True:
            line, found, rest = self._received.partition(b"\n")
            if not found:
                self._received += self._read(until, limit)
                continue
            self._received = rest
            if line.startswith(b"{"):
                return json.loads(line)

    def close(self, limit: float = END_LIMIT) -> None:
        """End the process: by the end of its input, then by SIGTERM, then by SIGKILL."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        with suppress(OSError):
            self._process.stdin.close()
        for end in (self._process.terminate, self._process.kill):
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(limit)
            if self._process.returncode is None:
                end()
        self._process.wait()
        self._process.stdout.close()

    def _read(self, until: float, limit: float) -> bytes:
        assert self._process.stdout is not None
        left = max(0.0, until - time.monotonic())
        if not select.select([self._process.stdout], [], [], left)[0]:
            raise PeerError(f"`{self._name}` has not answered within {limit:g} s.")
        received = os.read(self._process.stdout.fileno(), 1 << 16)
        if not received:
            raise PeerError(f"`{self._name}` has ended.")
        return received

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def serve(answer: Callable[[dict[str, Any]], Mapping[str, Any]]) -> None:
    """Greet the parent, then answer its questions until standard input ends."""
    reply({"pid": os.getpid()})
    for line in sys.stdin:
        reply(answer(json.loads(line)))


def reply(answer: Mapping[str, Any]) -> None:
    """Send one answer to the parent."""
    sys.stdout.write(json.dumps(answer) + "\n")
    sys.stdout.flush()


@contextmanager
def own_processes() -> Iterator[None]:
    """A context that ends every process which was started in it, also after a failure, Ctrl-C or SIGTERM."""
    mark = MARK + uuid.uuid4().hex
    os.environ[mark] = "1"
    before = signal.signal(signal.SIGTERM, _exit)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)
        del os.environ[mark]
        end_all(marked(mark))


def marked(mark: str) -> list[psutil.Process]:
    """Other processes that live and have this variable in their environment."""
    found: list[psutil.Process] = []
    for process in psutil.process_iter():
        # Processes of other users, and those that end meanwhile.
        with suppress(psutil.Error, OSError):
            if process.pid != os.getpid() and mark in process.environ():
                found.append(process)
    return found


def end_all(processes: Sequence[psutil.Process], limit: float = END_LIMIT) -> None:
    """End processes by pid: SIGTERM first, SIGKILL for those that are left."""
    left = list(processes)
    for end in (psutil.Process.terminate, psutil.Process.kill):
        for process in left:
            with suppress(psutil.NoSuchProcess):
                end(process)
        _, left = psutil.wait_procs(left, timeout=limit)


def _exit(number: int, frame: FrameType | None) -> None:
    del frame
    sys.exit(128 + number)
