"""Several nodes in one process: each has its own thread, and all of them end together."""

from __future__ import annotations

import logging
import signal
import threading
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import pytest

from skillwing.services.bus import Bus
from skillwing.services.bus.clock import WallClock
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.errors import InvalidOptionError, WrongSkillsetError
from skillwing.services.processes import hosting
from skillwing.services.processes.hosting import HEARTBEAT_PERIOD, Heartbeat, HostedNode, NetworkAddress, live_together
from skillwing.services.processes.lifetime import (
    EXIT_CONFIGURATION,
    EXIT_CRASHED,
    EXIT_OK,
    EXIT_REPLACED,
    EXIT_UNREACHABLE,
    Lifetime,
)
from skillwing.services.processes.router import start_router


class Guest:
    """A node that does something as soon as it is attached."""

    owns_clock = False

    def __init__(self, name: str, action: Callable[[Bus], None] = lambda bus: None) -> None:
        self.name = name
        self._action = action
        self.thread = ""
        self.detached = False

    def attach(self, bus: Bus) -> None:
        self.thread = threading.current_thread().name
        bus.post(lambda: self._action(bus))

    def detach(self) -> None:
        self.detached = True


@pytest.fixture(scope="module")
def endpoint() -> Iterator[str]:
    session, endpoint = start_router()
    with session:
        yield endpoint


@pytest.fixture
def lifetime(monkeypatch: pytest.MonkeyPatch) -> Lifetime:
    monkeypatch.setattr(signal, "signal", lambda number, handler: None)
    return Lifetime(parent_pipe=False)


def host(endpoint: str, lifetime: Lifetime, *guests: Guest) -> int:
    tenants = [HostedNode(guest.name, guest, WallClock(), f"house/alive/{guest.name}") for guest in guests]
    return live_together(tenants, NetworkAddress("house", endpoint), lifetime)


def raises(error: Exception) -> Callable[[Bus], None]:
    def action(bus: Bus) -> None:
        del bus
        raise error

    return action


def test_each_has_a_thread_of_its_name_and_all_end_well(endpoint: str, lifetime: Lifetime) -> None:
    guests = [Guest("a"), Guest("b"), Guest("c", lambda bus: lifetime.end())]
    assert host(endpoint, lifetime, *guests) == EXIT_OK
    assert [guest.thread for guest in guests] == ["a", "b", "c"]
    assert all(guest.detached for guest in guests)


@pytest.mark.parametrize(
    ("action", "code"),
    [
        (raises(RuntimeError("It broke.")), EXIT_CRASHED),
        (raises(WrongSkillsetError("It is another one.")), EXIT_CONFIGURATION),
        (lambda bus: bus.close(), EXIT_REPLACED),
    ],
)
def test_the_end_of_one_is_the_end_of_all_with_its_exit_code(
    endpoint: str, lifetime: Lifetime, action: Callable[[Bus], None], code: int
) -> None:
    well = Guest("well")
    assert host(endpoint, lifetime, well, Guest("unwell", action)) == code
    assert well.detached, "in good order"


def test_a_process_that_gives_up_names_itself(
    endpoint: str, lifetime: Lifetime, capsys: pytest.CaptureFixture[str]
) -> None:
    host(endpoint, lifetime, Guest("well"), Guest("unwell", raises(WrongSkillsetError("It is another one."))))
    assert capsys.readouterr().err == "unwell: It is another one.\n"


def test_a_node_with_wrong_files_gives_up_at_its_start(
    endpoint: str, lifetime: Lifetime, capsys: pytest.CaptureFixture[str]
) -> None:
    class Faulty(Guest):
        def attach(self, bus: Bus) -> None:
            raise InvalidOptionError("tree", "`fetch.rlc` has a mistake.")

    assert host(endpoint, lifetime, Guest("well"), Faulty("faulty")) == EXIT_CONFIGURATION
    assert capsys.readouterr().err == "faulty: `fetch.rlc` has a mistake.\n"


def test_without_router_nobody_lives(lifetime: Lifetime, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(hosting, "ZenohBus", partial(hosting.ZenohBus, connect_timeout=0.2))
    assert host("tcp/127.0.0.1:1", lifetime, Guest("a"), Guest("b")) == EXIT_UNREACHABLE


def test_a_stop_before_there_is_a_router_ends_well(
    lifetime: Lifetime, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The router may end first in a shutdown, without a message."""
    monkeypatch.setattr(hosting, "ZenohBus", partial(hosting.ZenohBus, connect_timeout=0.2))
    lifetime.end()
    assert host("tcp/127.0.0.1:1", lifetime, Guest("a"), Guest("b")) == EXIT_OK
    assert capsys.readouterr().err == ""


def test_a_node_that_does_not_end_keeps_nobody_alive(
    endpoint: str, lifetime: Lifetime, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """The process would hold no alive tokens, and its supervisor would wait for ever."""
    codes: list[int] = []
    awake = threading.Event()
    hangs = threading.Event()

    def hang(bus: Bus) -> None:
        del bus
        hangs.set()
        awake.wait()

    def crash(bus: Bus) -> None:
        del bus
        hangs.wait()
        raise RuntimeError("It broke.")

    monkeypatch.setattr(hosting, "ENDING_GRACE", 0.2)
    monkeypatch.setattr(hosting.os, "_exit", codes.append)
    monkeypatch.setattr(logging, "shutdown", lambda: None)
    host(endpoint, lifetime, Guest("sleeper", hang), Guest("breaker", crash))
    awake.set()
    assert codes == [EXIT_CRASHED]
    assert "sleeper did not end in time" in caplog.text


def test_a_heart_beats_only_while_all_of_them_do(tmp_path: Path) -> None:
    file = tmp_path / "beat"
    network = InProcessNetwork()
    heartbeat = Heartbeat(file, ["a", "b"])
    a, b = network.bus("a"), network.bus("b")
    heartbeat.keep(a)
    assert not file.exists()
    heartbeat.keep(b)
    assert file.exists()
    a.run_until(lambda: False, 2.5 * HEARTBEAT_PERIOD)
    file.unlink()
    b.close()
    a.run_until(lambda: False, 5.5 * HEARTBEAT_PERIOD)
    assert not file.exists()
