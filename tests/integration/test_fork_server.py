"""The fork server, by forks of hosts that wait for their standard input or find no robot."""

from __future__ import annotations

import os
import signal
import subprocess
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path

import psutil
import pytest

from skillwing.services.processes import forked_process
from skillwing.services.processes.child import Child
from skillwing.services.processes.fork_server import HOST
from skillwing.services.processes.forked_process import EXIT_UNKNOWN, SHARED, ForkedProcess, ForkServer
from skillwing.services.processes.lifetime import EXIT_CONFIGURATION

pytestmark = [pytest.mark.slow, pytest.mark.skipif(not hasattr(os, "pidfd_open"), reason="the fork server needs Linux")]

WITHIN = 60.0
WRONG_USAGE = 2
WAITS = ("--connect", "tcp/127.0.0.1:1", "--robot", "nowhere", "--process", "p", "--skillsets", "1")
"""Words for a host that waits for one byte, and then finds no robot."""


class Site:
    """A fork server with the log of its forks."""

    def __init__(self, folder: Path) -> None:
        self.server = ForkServer(os.environ)
        self.pid = self.server.pid
        self._log = folder / "log"
        self.forks: list[ForkedProcess] = []

    def fork(self, *words: str, environment: Mapping[str, str] | None = None) -> ForkedProcess:
        with self._log.open("ab") as log:
            self.forks.append(self.server.fork(words, environment or dict(os.environ), log.fileno()))
        return self.forks[-1]

    def log(self) -> str:
        return self._log.read_text(encoding="utf-8")

    def close(self) -> None:
        self.server.close()
        for fork in self.forks:
            fork.kill()
            fork.wait(WITHIN)
            assert fork.stdin is not None
            fork.stdin.close()


@pytest.fixture
def site(tmp_path: Path) -> Iterator[Site]:
    site = Site(tmp_path)
    yield site
    site.close()


def end_input(fork: ForkedProcess) -> None:
    assert fork.stdin is not None
    fork.stdin.close()


def test_a_fork_ends_with_the_code_and_the_words_of_a_new_process(site: Site) -> None:
    assert site.fork("--help").wait(WITHIN) == 0
    assert "Host one node of a robot." in site.log()
    assert site.fork("--process", "p").wait(WITHIN) == WRONG_USAGE


def test_a_fork_that_is_killed_tells_the_signal(site: Site) -> None:
    fork = site.fork(*WAITS)
    assert fork.poll() is None
    with pytest.raises(subprocess.TimeoutExpired):
        fork.wait(0.0)
    fork.kill()
    assert fork.wait(WITHIN) == -signal.SIGKILL
    assert fork.poll() == -signal.SIGKILL
    fork.terminate()


def test_a_fork_holds_nothing_of_another(site: Site) -> None:
    """A descriptor that another fork holds would hide the end of a launcher, or of a process."""
    first, second = site.fork(*WAITS), site.fork(*WAITS)
    assert psutil.Process(second.pid).num_fds() == 3
    end_input(first)
    assert first.wait(WITHIN) == EXIT_CONFIGURATION
    assert second.poll() is None


def test_a_fork_has_the_environment_of_its_order(site: Site) -> None:
    environment = {**os.environ, "SKILLWING_CONNECT": "tcp/127.0.0.1:1", "SKILLWING_ROBOT": "./not_in_the_order"}
    assert site.fork("--process", "p", environment=environment).wait(WITHIN) == EXIT_CONFIGURATION
    assert "not_in_the_order" in site.log()
    assert site.fork("--process", "p").wait(WITHIN) == WRONG_USAGE


def test_a_fork_is_a_session_of_its_own_with_its_command_line(site: Site) -> None:
    fork = site.fork(*WAITS)
    assert psutil.Process(fork.pid).cmdline()[1:] == ["-m", HOST, *WAITS]
    assert os.getsid(fork.pid) == fork.pid


def test_another_folder_or_search_path_needs_another_server(
    site: Site, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert site.server.fits({**os.environ, "SKILLWING_ROBOT": "other"})
    assert not site.server.fits({**os.environ, "PYTHONPATH": "elsewhere"})
    monkeypatch.chdir(tmp_path)
    assert not site.server.fits(os.environ)


def test_forks_outlive_the_server_without_an_exit_code(site: Site) -> None:
    fork = site.fork(*WAITS)
    os.kill(site.pid, signal.SIGKILL)
    psutil.wait_procs([psutil.Process(site.pid)], timeout=WITHIN)
    with pytest.raises(OSError):
        site.server.fork(WAITS, os.environ, 2)
    assert fork.poll() is None
    end_input(fork)
    assert fork.wait(WITHIN) == EXIT_UNKNOWN


@contextmanager
def no_server() -> Iterator[None]:
    """The state of a process without fork server, until the end of the block."""
    before, SHARED.server = SHARED.server, None
    try:
        yield
    finally:
        SHARED.close()
        SHARED.server = before


def ended(child: Child, *, start_server: bool) -> str:
    """The sentence on the end of a life."""
    child.start(0.0, start_server=start_server)
    child.process.wait(WITHIN)
    with suppress(psutil.NoSuchProcess):
        psutil.Process(child.process.pid).wait(WITHIN)
    sentence = str(child.exited(1.0))
    child.kill()
    return sentence


def host(folder: Path) -> Child:
    return Child("p", [HOST, "--process", "p"], folder / "p.log", restart="never")


def test_a_child_is_forked_by_a_server_that_may_be_started(tmp_path: Path) -> None:
    with no_server():
        child = host(tmp_path)
        child.start(0.0)
        assert isinstance(child.process, subprocess.Popen)
        child.kill()
        assert ended(child, start_server=True) == f"p ended with exit code {WRONG_USAGE}."
        assert isinstance(child.process, ForkedProcess)
        child.start(2.0)
        assert isinstance(child.process, ForkedProcess), "the next life is forked as well"
        child.kill()


def test_without_a_server_a_child_starts_all_the_same(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(forked_process, "SERVER", "skillwing.no_such_module")
    with no_server():
        assert ended(host(tmp_path), start_server=True) == f"p ended with exit code {WRONG_USAGE}."
        assert SHARED.server is None


def test_where_processes_have_no_descriptors_nothing_is_forked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(forked_process, "_has_descriptors", lambda: False)
    with no_server():
        assert ended(host(tmp_path), start_server=True) == f"p ended with exit code {WRONG_USAGE}."
        assert SHARED.server is None


@pytest.mark.parametrize("number", [signal.SIGSTOP, signal.SIGKILL])
def test_a_server_that_does_not_answer_is_given_up(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: signal.Signals
) -> None:
    monkeypatch.setattr(forked_process, "PATIENCE", 0.1)
    with no_server():
        server = SHARED.server = ForkServer(os.environ)
        os.kill(server.pid, number)
        assert ended(host(tmp_path), start_server=False) == f"p ended with exit code {WRONG_USAGE}."
        assert SHARED.server is None


def test_an_exit_code_that_nobody_saw_is_said() -> None:
    child = Child("p", [HOST], Path(os.devnull), restart="never")
    child.process = subprocess.Popen(["sh", "-c", f"exit {EXIT_UNKNOWN}"])
    assert "not known" in str(child.exited(0.0))


def test_a_server_with_another_search_path_is_replaced(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with no_server(), (tmp_path / "log").open("wb") as log:
        for path in ("one", "other"):
            monkeypatch.setenv("PYTHONPATH", path)
            fork = SHARED.fork(["--help"], dict(os.environ), log.fileno(), start_server=True)
            assert fork is not None
            assert fork.wait(WITHIN) == 0
            assert fork.stdin is not None
            fork.stdin.close()
            assert SHARED.server is not None
            assert SHARED.server.fits(os.environ)
