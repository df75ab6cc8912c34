"""Processes of benchmarks: time limits, and no process left behind after a failure or an interruption."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest

from benchmark_scripts import script

peers = script("peer_process")
checkouts = script("checkouts")
script("performance_page")
latency = script("latency")

ECHO = "from peer_process import serve; serve(lambda question: question)"
HANG = "import signal; signal.pause()"
ROSCORE = f"""#!{sys.executable}
import signal, subprocess, sys
subprocess.Popen([sys.executable, "-c", {HANG!r}], start_new_session=True)
signal.pause()
"""
GREETS_ONLY = """
import signal
print("a line of the middleware", flush=True)
print("{}", flush=True)
signal.pause()
"""
LIMIT = 0.2


@contextmanager
def nothing_stays() -> Iterator[None]:
    """A context after which no process lives that was started in it."""
    before = set(os.environ)
    with peers.own_processes():
        (mark,) = set(os.environ) - before
        yield
    assert not peers.marked(mark)
    assert mark not in os.environ


def command(code: str) -> list[str]:
    return [sys.executable, "-c", code]


def echo(stack: ExitStack) -> peers.PeerProcess:
    path = {"PYTHONPATH": str(checkouts.HERE)}
    return stack.enter_context(peers.PeerProcess(command(ECHO), path))


def test_a_peer_answers_each_question() -> None:
    with ExitStack() as stack:
        peer = echo(stack)
        assert peer.greeting == {"pid": peer.pid}
        assert peer.ask({"calls": 3}, 30.0) == {"calls": 3}
        assert peer.ask({"calls": 4}, 30.0) == {"calls": 4}


def test_a_peer_that_hangs_at_its_start_is_ended() -> None:
    with nothing_stays(), pytest.raises(peers.PeerError, match="has not answered within"):
        peers.PeerProcess(command(HANG), limit=LIMIT)


def test_a_peer_that_ends_is_an_error_at_once() -> None:
    with pytest.raises(peers.PeerError, match="has ended"):
        peers.PeerProcess(command("pass"))


def test_a_question_without_an_answer_ends_after_its_limit() -> None:
    with nothing_stays():
        peer = peers.PeerProcess(command(GREETS_ONLY))
        with pytest.raises(peers.PeerError, match="has not answered"):
            peer.ask({"calls": 1}, LIMIT)
        peer.close(LIMIT)


@pytest.mark.parametrize("interruption", [KeyboardInterrupt, SystemExit, AssertionError])
def test_an_interrupted_benchmark_leaves_no_process(interruption: type[BaseException]) -> None:
    with pytest.raises(interruption), nothing_stays():
        child = subprocess.Popen(command(f"import subprocess; subprocess.run([{sys.executable!r}, '-c', {HANG!r}])"))
        assert child.poll() is None
        raise interruption


def test_a_terminated_benchmark_leaves_no_process() -> None:
    """SIGTERM to the benchmark ends its peers, too."""
    body = f"""
import subprocess, sys
from peer_process import own_processes
with own_processes():
    child = subprocess.Popen([sys.executable, "-c", {HANG!r}])
    print(child.pid, flush=True)
    child.wait()
"""
    environment = {**os.environ, "PYTHONPATH": str(checkouts.HERE)}
    with subprocess.Popen(command(body), stdout=subprocess.PIPE, env=environment) as benchmark:
        assert benchmark.stdout is not None
        pid = int(benchmark.stdout.readline())
        benchmark.terminate()
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)


# --- ROS 1 -----------------------------------------------------------------------------------------------------------


@pytest.fixture
def roscore(tmp_path: Path) -> str:
    """A fake roscore: it starts a process in a session of its own, and hangs, deaf to the end of its input."""
    file = tmp_path / "roscore"
    file.write_text(ROSCORE)
    file.chmod(0o755)
    return str(file)


def ros_system(roscore: str, peer: Path, code: str) -> peers.PeerProcess:
    peer.write_text(code)
    arguments = (roscore, sys.executable, str(peer), f"{LIMIT:g}")
    return peers.PeerProcess(checkouts.script("ros_system.py", *arguments), checkouts.code_of(checkouts.ROOT))


def test_a_ros_that_hangs_at_its_start_leaves_no_process(tmp_path: Path, roscore: str) -> None:
    with nothing_stays(), pytest.raises(peers.PeerError, match="has ended"):
        ros_system(roscore, tmp_path / "peer.py", HANG)


def test_a_ros_that_does_not_start_is_named_on_the_page(
    tmp_path: Path, roscore: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path), prepend=os.pathsep)
    monkeypatch.setattr(latency, "ROS_PYTHON", "/bin/false")
    monkeypatch.setattr(latency, "ROS_START_LIMIT", LIMIT)
    with nothing_stays(), ExitStack() as stack:
        actionlib, absence = latency.open_actionlib(stack)
    assert actionlib is None
    assert absence.startswith("ROS 1 did not start")


def test_without_ros_the_page_says_so(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with ExitStack() as stack:
        assert latency.open_actionlib(stack) == (None, "ROS 1 is not installed here.")


class Answers:
    """A system that answers at once; from the second block on, its actionlib is silent."""

    def __init__(self) -> None:
        self.blocks = 0

    def ask(self, question: dict[str, object], limit: float) -> dict[str, object]:
        if "role" in question:
            return {"times": {"query": [1.0]}, "cpu": {}, "publications": 0}
        self.blocks += 1
        if self.blocks > 1:
            raise peers.PeerError("silent")
        return {"result": [1.0]}


def test_an_actionlib_that_falls_silent_is_left_out() -> None:
    system = Answers()
    found = latency.measure({"router": system}, 3, 1, system)
    assert [len(block.query) for block in found["router"]] == [3, 3, 3]
    assert [block.actionlib for block in found["router"]] == [[], [], []]
    assert system.blocks == 2
