"""One process of a system through all its lives: start, exit, log and restart."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from datetime import datetime
from io import FileIO
from pathlib import Path

from skillwing.services.processes.lifetime import EXIT_CONFIGURATION, EXIT_OK
from skillwing.services.processes.process_state import ProcessState
from skillwing.services.processes.restart_policy import RestartPolicy
from skillwing.services.robot import Restart

LOG_LINES = 8
LOG_BYTES = 8_000_000
"""Size at which a log is moved to `NAME.log.1`; a process has twice as much at most."""
RESTARTED = "--- restarted"
"""Begin of the log line that divides two lives of a process."""
STAMP = "%H:%M:%S"
SINGLE_THREADED = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
"""Environment of each process. The libraries below numpy would share each product of matrices among all cores. With the
small matrices of a filter that gains no time, and takes the cores from other processes."""
PERSONAL = ("SKILLWING_KEYS", "SKILLWING_INSECURE")
"""Variables of a person's commands, which are not for the processes of a system."""
_PLACE = re.compile(r'^\s*File "(?P<file>[^"<>]+)", line (?P<line>\d+)')
"""A place in a traceback."""


@dataclass(frozen=True, slots=True)
class ProcessExit:
    """Exit of a process that was not told to end. Either exit_code or signal is set. log: its last lines.

    pause: seconds until the restart, None for a process that stays down. outlook: the same in a sentence.
    """

    process: str
    pid: int
    exit_code: int | None
    signal: int | None
    log: tuple[str, ...]
    pause: float | None = None
    outlook: str = ""

    @property
    def final(self) -> bool:
        """True for a process that stays down."""
        return self.pause is None

    def __str__(self) -> str:
        if self.signal is not None:
            return f"{self.process} was killed by {_signal_name(self.signal)}."
        return f"{self.process} ended with exit code {self.exit_code}."


class Child:
    """A Python module run as a child of this process, with its log.

    command: the module and its arguments. restart, essential: as in its `ProcessSpec`. talks: it holds an alive token.
    nodes: those that share it. told: bytes on its standard input at each start, few enough for the buffer of a pipe.
    `process`: its present or last life, from the first `start` on.
    Use it under the launcher's lock.
    """

    def __init__(
        self,
        name: str,
        command: Sequence[str],
        log: Path,
        *,
        restart: Restart,
        essential: bool = True,
        talks: bool = True,
        nodes: tuple[str, ...] = (),
        told: bytes = b"",
    ) -> None:
        self.name = name
        self.command = tuple(command)
        self.log = log
        self._restart = restart
        self._policy = RestartPolicy(restart)
        self._started = 0.0
        self._lives = 0
        self._last_exit: ProcessExit | None = None
        self._essential = essential
        self._talks = talks
        self._nodes = nodes
        self._told = told

    def start(self, now: float, stdout: int | None = None) -> None:
        """Begin a life at second `now`; a line in the log marks the restart. On a full disk it may have no log."""
        if self._lives:
            self._close_pipes()
        with self._opened_log() as file:
            if self._lives:
                line = f"{RESTARTED} at {datetime.now().astimezone():{STAMP}}, life {self._lives + 1} ---\n"
                with suppress(OSError):  # a full disk must not prevent the restart
                    file.write(line.encode())
            self.process = subprocess.Popen(
                [sys.executable, "-m", *self.command],
                stdin=subprocess.PIPE,
                stdout=file if stdout is None else stdout,
                stderr=file,
                env={name: value for name, value in os.environ.items() if name not in PERSONAL} | SINGLE_THREADED,
                start_new_session=True,
            )
        if self._told and self.process.stdin is not None:
            with suppress(OSError):  # it has ended already
                os.write(self.process.stdin.fileno(), self._told)
        self._lives += 1
        self._started = now
        self._last_exit = None

    def _opened_log(self) -> FileIO:
        try:
            self.log.parent.mkdir(parents=True, exist_ok=True)
            return self.log.open("ab", buffering=0)
        except OSError:  # a full disk must not prevent the start
            return Path(os.devnull).open("ab", buffering=0)

    def shorten_log(self) -> None:
        """Move a long log aside. The process goes on in the same file, which is empty then."""
        try:
            if self.log.stat().st_size < LOG_BYTES:
                return
            shutil.copyfile(self.log, self.log.with_name(f"{self.log.name}.1"))
            os.truncate(self.log, 0)
        except OSError:  # it is tried again
            return

    def exited(self, now: float) -> ProcessExit:
        """Record the end of a life; the process has ended already."""
        code = self.process.returncode
        hopeless = code == EXIT_CONFIGURATION
        # A router, which has no token, never ends in good order by itself. Nodes may, again and again.
        told = code == EXIT_OK and not self._talks
        pause = self._policy.exited(now, self._started, hopeless=hopeless, told=told)
        exit_code, number = (code, None) if code >= 0 else (None, -code)
        log = self.last_lines()
        outlook = self._outlook(pause, hopeless, log)
        self._last_exit = ProcessExit(self.name, self.process.pid, exit_code, number, log, pause, outlook)
        return self._last_exit

    def not_started(self, error: OSError, pause: float) -> None:
        """Note that the machine had no room for the next life, which is tried again after `pause` seconds."""
        if self._last_exit is not None:
            outlook = f"It cannot be started now: {error.strerror or error}. That is tried again in {pause:g} s."
            self._last_exit = replace(self._last_exit, outlook=outlook)

    def _outlook(self, pause: float | None, hopeless: bool, log: Sequence[str]) -> str:
        if pause is not None:
            return f"It is started again in {pause:g} s."
        if self._restart == "never":
            return "It is not started again: a new one could not continue from its end."
        words = f"its last log line: {_last_line(log)}" if log else "it logged nothing in its last run"
        if hopeless:
            return f"It cannot run as configured; {words}. It stays down. Its log: {self.log}"
        policy = self._policy
        return f"It exited {policy.exits} times in {policy.span:.0f} s; {words}; it stays down. Its log: {self.log}"

    def last_lines(self) -> tuple[str, ...]:
        """The last log lines of this life."""
        try:
            text = self.log.read_text(encoding="utf-8", errors="replace")
        except OSError:
            return ()
        _, marker, life = text.rpartition(RESTARTED)
        lines = life.splitlines()[1 if marker else 0 :]
        return tuple(lines[-LOG_LINES:])

    def state(self) -> ProcessState:
        last_exit = self._last_exit
        return ProcessState(
            name=self.name,
            pid=self.process.pid,
            life="lives" if last_exit is None else "given up" if last_exit.final else "waits",
            restarts=max(0, self._lives - 1),
            last_words="" if last_exit is None else f"{last_exit} {last_exit.outlook}",
            essential=self._essential,
            talks=self._talks,
            nodes=self._nodes,
        )

    def kill(self) -> None:
        """Kill the process if it still runs, and close its pipes."""
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()
        self._close_pipes()

    def _close_pipes(self) -> None:
        for pipe in (self.process.stdin, self.process.stdout):
            if pipe is not None:
                pipe.close()


def _signal_name(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:  # most of the real-time signals
        return f"signal {number}"


def _last_line(log: Sequence[str]) -> str:
    """The last line of a log, with file and line at the end of a traceback."""
    *before, last = log
    last = last.strip().rstrip(".")
    for line in reversed(before):
        if place := _PLACE.match(line):
            return f"{last} ({place['file']}:{place['line']})"
        if not line.startswith(" "):
            break
    return last
