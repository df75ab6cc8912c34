"""`skillwing router`: its end while robots use it, and its words about an address that strangers reach."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from command_line import Command
from running_system import until
from shuttle import SHUTTLE

from skillwing.services.terminal.exit_codes import NO_SYSTEM, OK, USAGE

TIMEOUT = 30.0
REACHED = "tcp/LOCALHOST:0"
"""An address on loopback, in a spelling that the rule for exposed addresses does not know."""


@contextmanager
def routing(*words: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """A router process with its endpoint. It has ended afterwards."""
    command = [sys.executable, "-m", "skillwing.services.terminal.cli", "router", *words]
    router = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        assert router.stdout is not None
        yield router, router.stdout.readline().strip()
    finally:
        router.kill()
        router.wait(TIMEOUT)


def line_of(router: subprocess.Popen[str]) -> str:
    assert router.stderr is not None
    return router.stderr.readline().strip()


def ends_by_ctrl_c(router: subprocess.Popen[str]) -> bool:
    router.send_signal(signal.SIGINT)
    try:
        router.wait(3.0)
    except subprocess.TimeoutExpired:
        return False
    return True


@pytest.fixture(scope="module")
def shuttle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("shuttle") / "shuttle.skillset"
    file.write_text(SHUTTLE, encoding="utf-8")
    return file


@contextmanager
def shuttle_at(endpoint: str, skillwing: Command, shuttle: Path) -> Iterator[None]:
    """A mocked robot `lift` at a router."""
    options = ("--detach", "--colocate", "--no-record", "--run-dir", str(shuttle.parent / "run"))
    said = skillwing("mock", str(shuttle), "--robot-name", "lift", "--router", endpoint, *options)
    assert said.code == OK, said.error
    try:
        yield
    finally:
        skillwing("down", "--robot", "lift")


def test_ctrl_c_warns_while_a_robot_uses_the_router(skillwing: Command, shuttle: Path) -> None:
    with routing("--listen", "tcp/127.0.0.1:0") as (router, endpoint), shuttle_at(endpoint, skillwing, shuttle):
        router.send_signal(signal.SIGINT)
        assert line_of(router) == (
            "This router connects `lift` with those who command them. Ctrl-C again ends it all the same."
        )
        assert skillwing("status", "--robot", "lift").code == OK

        # Signals within a second repeat the first one.
        until(lambda: ends_by_ctrl_c(router), "the end of the router")
        assert line_of(router) == "`lift` is without a router now."
        assert router.returncode == OK


def test_a_kill_does_not_ask_and_names_the_robots(skillwing: Command, shuttle: Path) -> None:
    with routing("--listen", "tcp/127.0.0.1:0") as (router, endpoint), shuttle_at(endpoint, skillwing, shuttle):
        router.terminate()
        assert router.wait(TIMEOUT) == OK
        assert line_of(router) == "`lift` is without a router now."


def test_a_branch_of_a_tree_does_not_know_which_robots_are_its_own(skillwing: Command, shuttle: Path) -> None:
    with (
        routing("--listen", "tcp/127.0.0.1:0") as (_, root),
        routing("--listen", "tcp/127.0.0.1:0", "--connect", root) as (branch, endpoint),
        shuttle_at(endpoint, skillwing, shuttle),
    ):
        branch.terminate()
        assert branch.wait(TIMEOUT) == OK
        assert line_of(branch) == "`lift` may be without a router now."


def test_a_router_that_nobody_uses_ends_at_once_and_says_nothing() -> None:
    with routing("--listen", "tcp/127.0.0.1:0") as (router, _):
        router.send_signal(signal.SIGINT)
        assert router.wait(TIMEOUT) == OK
        assert line_of(router) == ""


def test_a_plain_address_is_refused_with_keys_also_the_usual_one(
    skillwing: Command, shuttle: Path, tmp_path: Path
) -> None:
    keys = ("--keys", str(tmp_path / "keys"))
    assert skillwing("keys", "init", keys[1], "--skillset", str(shuttle)).code == OK
    refused = skillwing("router", *keys, "--listen", "tcp/127.0.0.1:7447")
    assert refused.code == USAGE
    assert "Write --listen tls/HOST:PORT." in refused.error


def test_the_log_of_an_exposed_router_says_who_reaches_it() -> None:
    with routing("--listen", REACHED, "--insecure") as (router, endpoint):
        assert endpoint.startswith("tcp/LOCALHOST:")
        assert line_of(router) == (
            f"Everybody who reaches {REACHED} can read and command the robot: it listens without keys (--insecure)."
        )


def test_up_and_doctor_say_that_everybody_reaches_an_exposed_robot(
    skillwing: Command, shuttle: Path, tmp_path: Path
) -> None:
    words = ("mock", str(shuttle), "--colocate", "--no-record", "--run-dir", str(tmp_path), "--listen", REACHED)
    assert skillwing(*words, "--detach").code == USAGE
    said = skillwing(*words, "--insecure", "--detach")
    assert said.code == OK, said.error
    try:
        findings = skillwing("doctor", "--robot", "shuttle", "--json").json["findings"]
    finally:
        skillwing("down", "--robot", "shuttle")
    exposed = [finding for finding in findings if finding["about"] == "exposed"]
    assert [finding["serious"] for finding in exposed] == [True]
    assert "Everybody who reaches tcp/LOCALHOST:" in exposed[0]["what"]
    assert "Everybody who reaches tcp/LOCALHOST:" in said.error
    log = (tmp_path / "logs" / "up.log").read_text(encoding="utf-8")
    assert "Everybody who reaches tcp/LOCALHOST:" in log


def test_a_second_robot_of_a_name_at_one_router_is_refused_before_it_takes_a_place(
    skillwing: Command, shuttle: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with routing("--listen", "tcp/127.0.0.1:0") as (_, endpoint), shuttle_at(endpoint, skillwing, shuttle):
        with monkeypatch.context() as elsewhere:
            elsewhere.setenv("XDG_RUNTIME_DIR", str(tmp_path))
            said = skillwing("mock", str(shuttle), "--robot-name", "lift", "--router", endpoint, "--no-record")
        assert said.code != OK
        assert f"`lift` runs at the router {endpoint} already." in said.error
        assert "--robot-name" in said.error
        log = (shuttle.parent / "run" / "logs").glob("*.log")
        assert not any("taken its place" in each.read_text() for each in log)


def test_a_robot_says_that_the_router_of_another_system_is_away_and_back(skillwing: Command, shuttle: Path) -> None:
    with routing("--listen", "tcp/127.0.0.1:0") as (router, endpoint), shuttle_at(endpoint, skillwing, shuttle):
        log = shuttle.parent / "run" / "logs" / "up.log"
        router.send_signal(signal.SIGSTOP)
        until(lambda: f"{endpoint} has not answered since" in log.read_text(), "the sentence about the lost router")
        said = skillwing("status", "--robot", "lift")
        assert said.code == NO_SYSTEM
        assert "`lift` runs (process " in said.error
        assert f"its router does not answer at {endpoint}" in said.error
        router.send_signal(signal.SIGCONT)
        until(lambda: f"{endpoint} answers again at" in log.read_text(), "the sentence about the router")


def test_a_router_whose_upper_one_is_absent_says_so() -> None:
    with routing("--listen", "tcp/127.0.0.1:0", "--connect", "tcp/127.0.0.1:1") as (router, _):
        assert line_of(router) == "No router answers at tcp/127.0.0.1:1 yet. This one goes on trying."
