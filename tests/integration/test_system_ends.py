"""Ends of a system's command, in a pipe and on a terminal: no process remains."""

from __future__ import annotations

import contextlib
import os
import pty
import random
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import psutil
import pytest

from skillwing.services.processes.run_state import RunState, read_run_state
from skillwing.services.processes.stop_signal import SAME_REQUEST
from skillwing.services.terminal.exit_codes import OK

pytestmark = pytest.mark.slow

PATIENCE = 60.0
POLL = 0.02
STARTING = 1.5
"""Seconds that the small system takes to start, about."""
SKILLSET = "skillset lamp { skill shine { result { success DONE } } }"


@pytest.fixture
def command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The command that runs a small system, in a runtime directory of its own."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.setenv("TERM", "xterm-256color")
    (tmp_path / "lamp.skillset").write_text(SKILLSET, encoding="utf-8")
    file, run_dir = str(tmp_path / "lamp.skillset"), str(tmp_path / "run")
    return [sys.executable, "-m", "skillwing.services.terminal.cli", "mock", file, "--no-record", "--run-dir", run_dir]


def until_it_runs(process: subprocess.Popen[bytes]) -> RunState:
    deadline = time.monotonic() + PATIENCE
    while (state := read_run_state("lamp")) is None:
        assert process.poll() is None
        assert time.monotonic() < deadline
        time.sleep(POLL)
    return state


@contextmanager
def leaving_nothing(process: subprocess.Popen[bytes]) -> Iterator[list[psutil.Process]]:
    """Runs the body with the system's processes, none of which may be left afterwards, nor its run state."""
    try:
        until_it_runs(process)
        children = psutil.Process(process.pid).children()
        assert len(children) == 5
        yield children
        process.wait(PATIENCE)
    finally:
        process.kill()  # of a test that fails: its other processes end with it
    assert psutil.wait_procs(children, timeout=PATIENCE)[1] == []
    assert read_run_state("lamp") is None


@pytest.mark.parametrize(
    "signals",
    [[signal.SIGTERM], [signal.SIGINT, signal.SIGINT]],
    ids=lambda numbers: "+".join(number.name for number in numbers),
)
def test_in_a_pipe(command: Sequence[str], signals: Sequence[signal.Signals]) -> None:
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE) as process:
        with leaving_nothing(process):
            for number in signals:
                process.send_signal(number)
        assert process.stderr is not None
        assert b"Traceback" not in process.stderr.read()
    assert process.returncode == OK


def test_when_one_of_its_processes_hangs_and_it_is_stopped_twice(command: Sequence[str]) -> None:
    with (
        subprocess.Popen(command, stdout=subprocess.DEVNULL) as process,
        leaving_nothing(process) as children,
    ):
        *_, other, hung = children
        hung.suspend()
        process.send_signal(signal.SIGINT)
        other.wait(PATIENCE)
        time.sleep(SAME_REQUEST)  # until then it is the same Ctrl-C
        process.send_signal(signal.SIGINT)


@pytest.mark.parametrize("seed", range(3))
def test_while_it_starts(command: Sequence[str], tmp_path: Path, seed: int) -> None:
    """Ctrl-C at any moment is heard: also while modules are loaded, and inside a callback of the network."""
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE) as process:
        deadline = time.monotonic() + PATIENCE
        while not _catches(process.pid, signal.SIGHUP):
            assert process.poll() is None
            assert time.monotonic() < deadline
            time.sleep(POLL / 10)
        time.sleep(random.Random(seed).uniform(0.0, STARTING))
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=PATIENCE)
    assert (process.returncode, errors) == (OK, b"")
    assert _living_in(tmp_path) == []
    assert read_run_state("lamp") is None


@pytest.mark.parametrize("end", ["Ctrl-C", "a closed terminal"])
def test_on_a_terminal(command: Sequence[str], end: str) -> None:
    terminal, side = pty.openpty()
    process = subprocess.Popen(["setsid", "--ctty", *command], stdin=side, stdout=side, stderr=side)
    os.close(side)
    with leaving_nothing(process):
        if end == "Ctrl-C":
            os.write(terminal, b"\x03")
            _read_to_the_end(terminal)
        os.close(terminal)


def _catches(pid: int, number: signal.Signals) -> bool:
    """A process has a handler for a signal; Python itself has one for SIGINT only."""
    status = Path(f"/proc/{pid}/status").read_text(encoding="ascii")
    caught = next(line.split()[1] for line in status.splitlines() if line.startswith("SigCgt"))
    return bool(int(caught, 16) >> (number - 1) & 1)


def _living_in(runtime_dir: Path) -> list[psutil.Process]:
    """The processes that were started with a runtime directory."""
    found: list[psutil.Process] = []
    for process in psutil.process_iter():
        with contextlib.suppress(psutil.Error):
            if process.environ().get("XDG_RUNTIME_DIR") == str(runtime_dir):
                found.append(process)
    return found


def _read_to_the_end(terminal: int) -> None:
    """Keep the process from waiting for a reader. Linux says with an error that nobody has the other side any more."""
    with contextlib.suppress(OSError):
        while os.read(terminal, 4096):
            pass
