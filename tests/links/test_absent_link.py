"""Commands that begin while the link to the robot is away."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from namespaces import ROBOT_ADDRESS, TwoNamespaces, obstacle

from skillwing.services.access import handshake
from skillwing.services.access.identity_files import read_identity
from skillwing.services.access.key_store import KeyStore
from skillwing.services.bus.zenoh_session import LEASE, RouterUnreachableError
from skillwing.services.client import joining, target
from skillwing.services.client.target import find_target_at
from skillwing.services.diagnosis.examination import examine
from skillwing.services.errors import NoSystemError
from skillwing.services.wire.channel import Role

ENDPOINT = f"tcp/{ROBOT_ADDRESS}:7447"
CLI = [sys.executable, "-m", "skillwing.services.terminal.cli"]


def unreachable(address: object, timeout: float) -> None:
    """Stands for `socket.create_connection` on a cut link."""
    del address, timeout
    raise TimeoutError


@pytest.mark.parametrize("robot", [None, "m600", "another"])
def test_a_router_that_does_not_answer_is_asked_once(monkeypatch: pytest.MonkeyPatch, robot: str | None) -> None:
    asked: list[float] = []

    def silent(
        endpoint: str, robot: str | None = None, timeout: float = 0.0, identity: object = None
    ) -> dict[str, str]:
        asked.append(timeout)
        raise RouterUnreachableError(endpoint)

    def joined(*words: object) -> None:
        pytest.fail("the router was asked again")

    monkeypatch.setattr(joining, "robots_at", silent)
    monkeypatch.setattr(target, "join", joined)
    monkeypatch.setattr("socket.create_connection", unreachable)
    with pytest.raises(NoSystemError) as raised:
        find_target_at(ENDPOINT, robot)
    assert raised.value.endpoint == ENDPOINT
    assert asked == [joining.CONNECT_TIMEOUT]


def test_the_waits_of_a_command_leave_it_half_a_second_to_say_so_within_three() -> None:
    assert joining.CONNECT_TIMEOUT + handshake.CONNECT_TIMEOUT <= 2.5
    assert joining.CONNECT_TIMEOUT + 2 * handshake.PLAIN_TIMEOUT <= 2.5
    assert joining.CONNECT_TIMEOUT <= LEASE


def test_doctor_examines_the_expected_robot_where_the_router_does_not_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(joining, "CONNECT_TIMEOUT", 0.1)
    monkeypatch.setattr("skillwing.services.diagnosis.examination.CONNECT_TIMEOUT", 0.1)
    monkeypatch.setenv("SKILLWING_CONNECT", "tcp/127.0.0.1:1")
    seen = examine().system
    assert seen is not None
    assert (seen.robot, seen.router) == ("m600", False)
    assert examine("nobody").system is None


@pytest.mark.slow
def test_commands_on_a_cut_link_name_the_address_and_end_with_3(tmp_path: Path) -> None:
    reason = obstacle()
    if reason is not None:
        pytest.skip(reason)
    environment = {"SKILLWING_CONNECT": ENDPOINT, "XDG_RUNTIME_DIR": str(tmp_path)}
    with TwoNamespaces() as spaces:
        spaces.cut()
        for words in (["status"], ["start", "takeoff"], ["mission", "watch"]):
            process = spaces.start(spaces.station, [*CLI, *words], environment)
            try:
                said, _ = process.communicate(timeout=60)
            finally:
                process.kill()
            assert process.returncode == 3
            assert said.startswith(f"No router answers at {ENDPOINT}. ")


@pytest.mark.parametrize("protocol", ["tcp", "tls"])
def test_the_reason_of_a_silent_address_is_looked_for_by_one_connection(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, protocol: str
) -> None:
    store = KeyStore.init(tmp_path / "keys", [])
    identity = None if protocol == "tcp" else read_identity(store.add_person("alice", Role.CLIENT))
    tried: list[float] = []

    def connect(address: object, timeout: float) -> None:
        tried.append(timeout)
        unreachable(address, timeout)

    monkeypatch.setattr("socket.create_connection", connect)
    error = RouterUnreachableError(f"{protocol}/{ROBOT_ADDRESS}:7447")
    assert handshake.explained(error, identity) is error
    assert tried == [handshake.PLAIN_TIMEOUT if identity is None else handshake.CONNECT_TIMEOUT]
