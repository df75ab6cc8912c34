"""A router by itself with the keys of two robots, of which one computer has only its own keys."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from command_line import Command
from keyed_site import free_port, make_store, opened_by_file, opened_site
from shuttle import SHUTTLE

from skillwing.services.access.policy import RobotAccess
from skillwing.services.errors import NotKnownError
from skillwing.services.names import LAUNCHER
from skillwing.services.processes.launcher import Launcher
from skillwing.services.terminal.exit_codes import OK, REFUSED, USAGE
from skillwing.services.wire.channel import Role

TIMEOUT = 30.0


@dataclass(frozen=True)
class Fleet:
    """The address of the router, and the folder of its keys."""

    endpoint: str
    keys: Path


@pytest.fixture(scope="module")
def fleet(skillwing: Command, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Fleet]:
    folder = tmp_path_factory.mktemp("fleet")
    file, keys = folder / "shuttle.skillset", folder / "keys"
    file.write_text(SHUTTLE, encoding="utf-8")
    made = ("--skillset", str(file), "--robot-name")
    assert skillwing("keys", "init", str(keys), *made, "first").code == OK
    assert skillwing("keys", "add-robot", "shuttle", *made, "second", "--keys", str(keys)).code == OK
    assert skillwing("keys", "add", "alice", "--role", "client", "--keys", str(keys)).code == OK
    words = [sys.executable, "-m", "skillwing.services.terminal.cli", "router", "--listen", "tls/127.0.0.1:0"]
    # The keys of a person, for commands, are not those of the router.
    environment = {**os.environ, "SKILLWING_KEYS": str(keys / "people" / "alice")}
    router = subprocess.Popen([*words, "--keys", str(keys)], stdout=subprocess.PIPE, text=True, env=environment)
    try:
        assert router.stdout is not None
        endpoint = router.stdout.readline().strip()
        for name, own in (("first", keys), ("second", keys / "robots" / "second")):
            options = ("--robot-name", name, "--router", endpoint, "--keys", str(own), "--run-dir", str(folder / name))
            said = skillwing("mock", str(file), *options, "--detach", "--no-record", "--colocate")
            assert said.code == OK, said.error
        yield Fleet(endpoint, keys)
        for name in ("second", "first"):
            assert skillwing("down", "--robot", name).code == OK
    finally:
        router.send_signal(signal.SIGINT)
        assert router.wait(TIMEOUT) == OK


@pytest.fixture
def elsewhere(fleet: Fleet, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Fleet:
    """A place without run states, as another machine is, where alice has her keys."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.setenv("SKILLWING_CONNECT", fleet.endpoint)
    monkeypatch.setenv("SKILLWING_KEYS", str(fleet.keys / "people" / "alice"))
    monkeypatch.delenv("SKILLWING_ROBOT", raising=False)
    return fleet


@pytest.mark.usefixtures("elsewhere")
def test_one_folder_commands_both_robots_from_elsewhere(skillwing: Command) -> None:
    for name in ("first", "second"):
        said = skillwing("start", "go", "--robot", name, "--follow")
        assert said.code == OK, said.error
    several = skillwing("resources")
    assert several.code == USAGE
    assert "`first` and `second`" in several.error


def test_a_stranger_is_not_told_which_robots_there_are(
    elsewhere: Fleet, skillwing: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert skillwing("keys", "init", str(tmp_path / "own"), "--skillset", str(tmp_path / "none")).code == USAGE
    file = tmp_path / "shuttle.skillset"
    file.write_text(SHUTTLE, encoding="utf-8")
    keys = tmp_path / "keys"
    assert skillwing("keys", "init", str(keys), "--skillset", str(file)).code == OK
    assert skillwing("keys", "add", "mallory", "--role", "operator", "--keys", str(keys)).code == OK
    monkeypatch.setenv("SKILLWING_KEYS", str(keys / "people" / "mallory"))
    for words in (("resources",), ("resources", "--robot", "first")):
        refused = skillwing(*words)
        assert refused.code == REFUSED
        assert f"You are not known at {elsewhere.endpoint}" in refused.error
        assert "first" not in refused.out


@pytest.mark.parametrize("own", [True, False])
def test_a_robot_that_a_router_does_not_know_does_not_start_there(tmp_path: Path, own: bool) -> None:
    """A robot that was added after the start of the router. A zenohd says nobody's role, and knows the other one."""
    first, second = (RobotAccess(name, "shuttle", {LAUNCHER: Role.LAUNCHER}) for name in ("first", "second"))
    store = make_store(tmp_path / "keys", first)
    opened = (
        opened_site("first", store)
        if own
        else opened_by_file("first", store, f"tls/127.0.0.1:{free_port()}", confirms=False)
    )
    with opened as site:
        store.add_robot(second)

        def start(robot: str) -> None:
            with Launcher(
                robot, "shuttle", tmp_path, clock="wall", router=site.endpoint, keys=store.folder
            ) as launcher:
                launcher.start(())

        start("first")
        with pytest.raises(NotKnownError, match="restart the router"):
            start("second")
