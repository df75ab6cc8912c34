"""Remedies in messages of commands: they name what the user has, and commands that work."""

from __future__ import annotations

import os
import re
from dataclasses import replace
from pathlib import Path

import pytest
from typer.testing import CliRunner

from skillwing.m600.robot import SKILLSET
from skillwing.services.access.handshake import unknown_name
from skillwing.services.access.key_store import KeyStore
from skillwing.services.bus.zenoh_session import RouterUnreachableError
from skillwing.services.client.connection import find_target
from skillwing.services.commands import down as down_command
from skillwing.services.commands.keys import PersonRole
from skillwing.services.core.refusal import RefusedError
from skillwing.services.diagnosis.examination import examine
from skillwing.services.diagnosis.findings import diagnose
from skillwing.services.errors import InvalidOptionError, KeysError, NoMissionError, NoSystemError
from skillwing.services.processes import launcher as launcher_module
from skillwing.services.processes.launcher import Launcher
from skillwing.services.processes.process_state import ProcessState
from skillwing.services.processes.router import run_router
from skillwing.services.processes.run_state import RunState, started, write_run_state
from skillwing.services.terminal.cli import app
from skillwing.services.wire.channel import PEOPLE


@pytest.fixture(autouse=True)
def own_runtime_dir(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "runtime"))
    monkeypatch.delenv("SKILLWING_CONNECT", raising=False)


def announce(robot: str, *processes: ProcessState, endpoint: str = "tcp/127.0.0.1:1", listens: str = "") -> None:
    write_run_state(
        RunState(
            robot=robot,
            endpoint=endpoint,
            listens=listens,
            skillset=str(SKILLSET),
            clock="wall",
            pid=os.getpid(),
            pid_started=started(os.getpid()) or "",
            run_dir="runs/x",
            processes=processes,
        )
    )


@pytest.mark.parametrize(
    ("keys", "command"),
    [
        (None, "`skillwing router --listen tcp/127.0.0.1:7999`"),
        ("keys", "`skillwing router --listen tcp/127.0.0.1:7999 --keys keys`"),
    ],
)
def test_a_system_that_joins_a_router_names_the_command_that_starts_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, keys: str | None, command: str
) -> None:
    def fail(_name: str, _robot: str, endpoint: str, *_: object, **__: object) -> None:
        raise RouterUnreachableError(endpoint)

    monkeypatch.setattr(launcher_module, "ZenohBus", fail)
    monkeypatch.setattr(launcher_module, "process_identity", lambda *_: None)
    launcher = Launcher(
        "other", "m600", tmp_path, clock="wall", router="tcp/127.0.0.1:7999", keys=None if keys is None else Path(keys)
    )
    with pytest.raises(RouterUnreachableError, match=re.escape(command)):
        launcher.open_bus("launcher")


def test_the_end_of_a_router_names_every_system_to_stop_first(monkeypatch: pytest.MonkeyPatch) -> None:
    announce("left", ProcessState(name="router"))
    monkeypatch.setattr(down_command, "others_at_router", lambda *_: {"right": False, "yard": False})
    result = CliRunner().invoke(app, ["down", "--robot", "left"])
    assert isinstance(result.exception, RefusedError)
    commands = "`skillwing down --robot right` and `skillwing down --robot yard`"
    assert result.exception.help == f"Stop the others first, with {commands}, or use `--force`."


@pytest.mark.parametrize(
    ("listen", "text"),
    [
        ("7620", "`7620`, given by `listen`, is no address of a router. Write tcp/HOST:PORT"),
        ("tcp/127.0.0.1:0#iface=lo", "A router cannot listen at tcp/127.0.0.1:0#iface=lo. Write tcp/HOST:PORT"),
    ],
)
def test_a_malformed_address_of_a_router_is_a_wrong_option(listen: str, text: str) -> None:
    with pytest.raises(InvalidOptionError, match=f"^{re.escape(text)}"):
        run_router(listen, None, lambda *_: None, insecure=True)


def test_a_command_for_a_robot_that_does_not_run_names_its_start() -> None:
    with pytest.raises(NoSystemError, match=r"`skillwing up` and its `--robot`, or `--robot-name left`\."):
        find_target("left")
    with pytest.raises(NoSystemError, match=r"Start one with `skillwing up --robot m600`\."):
        find_target("m600")
    with pytest.raises(NoSystemError, match=r"Start one with `skillwing up --robot \./examples/yard`\."):
        find_target("./examples/yard")


def test_a_request_to_a_mission_names_the_robots_that_have_one() -> None:
    text = "No mission runs here. One runs at `left` and `right`: choose with `--robot left`."
    assert str(NoMissionError(["left", "right"])) == text


def test_people_are_offered_the_roles_of_people() -> None:
    assert [role.value for role in PersonRole] == [role.value for role in PEOPLE]
    result = CliRunner().invoke(app, ["keys", "add", "bob", "--role", "admin"])
    assert "operator" in str(result.exception)
    assert "launcher" not in str(result.exception)


def test_new_keys_of_a_person_name_their_folder_on_both_machines(tmp_path: Path) -> None:
    store = KeyStore.init(tmp_path / "keys", [])
    result = CliRunner().invoke(app, ["keys", "add", "alice", "--role", "viewer", "--keys", str(store.folder)])
    assert result.exit_code == 0, result.output
    assert "There: `export SKILLWING_KEYS=alice`." in result.output
    assert f"On this machine: `export SKILLWING_KEYS={store.folder / 'people' / 'alice'}`." in result.output


@pytest.mark.parametrize("listens", ["", "tls/192.168.1.7:7447"])
def test_status_shows_the_router_here_to_somebody_whom_it_does_not_know(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, listens: str
) -> None:
    announce("left", ProcessState(name="router", pid=os.getpid()), listens=listens, endpoint="tls/127.0.0.1:1")
    monkeypatch.setenv("SKILLWING_KEYS", str(tmp_path / "removed"))
    if listens:
        monkeypatch.setenv("SKILLWING_CONNECT", listens)
    result = CliRunner().invoke(app, ["status", "--robot", "left"])
    assert isinstance(result.exception, KeysError)
    assert re.search(rf"router +\S+ +{os.getpid()}", result.output)


def test_status_shows_no_process_of_this_machine_for_a_system_elsewhere(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    announce("left", ProcessState(name="router", pid=os.getpid()))
    monkeypatch.setenv("SKILLWING_KEYS", str(tmp_path / "removed"))
    monkeypatch.setenv("SKILLWING_CONNECT", "tls/192.168.1.7:7447")
    result = CliRunner().invoke(app, ["status", "--robot", "left"])
    assert isinstance(result.exception, KeysError)
    assert not result.output


def test_a_malformed_address_leaves_doctor_and_status_their_other_findings(monkeypatch: pytest.MonkeyPatch) -> None:
    announce("left", ProcessState(name="router", pid=os.getpid()))
    monkeypatch.setenv("SKILLWING_CONNECT", "robot:7447")
    findings = diagnose(replace(examine(), missing={"sim": ("mujoco",)}))
    assert [finding.about for finding in findings if finding.about in {"malformed_address", "missing_extra"}] == [
        "malformed_address",
        "missing_extra",
    ]
    assert findings[0].what == "`robot:7447`, given by `SKILLWING_CONNECT`, is no address of a router."
    result = CliRunner().invoke(app, ["status"])
    assert isinstance(result.exception, InvalidOptionError)
    assert re.search(rf"router +\S+ +{os.getpid()}", result.output)


def test_a_name_that_the_router_does_not_know_has_two_remedies() -> None:
    assert "restart the router" in str(unknown_name("tls/127.0.0.1:1"))
    assert "ask the owner" in str(unknown_name("tls/127.0.0.1:1"))
