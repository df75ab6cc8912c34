"""The plain client prints a goal's status after the states of its step, and repeats requests after silences."""

from __future__ import annotations

import importlib.util
import json
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from msgspec import msgpack

FILE = Path(__file__).parents[3] / "examples" / "plain_client" / "client.py"
_spec = importlib.util.spec_from_file_location("plain_client", FILE)
assert _spec is not None
assert _spec.loader is not None
plain_client = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(plain_client)


def payload(message: dict[str, Any]) -> SimpleNamespace:
    return SimpleNamespace(payload=SimpleNamespace(to_bytes=lambda: msgpack.encode(message)))


class Network:
    """The part of a Zenoh session that the client uses. `step` is that of the resource manager."""

    def __init__(self) -> None:
        self.step = 5
        self.hear: Callable[[Any], None] = lambda sample: None

    def get(self, key: str, **_: Any) -> list[SimpleNamespace]:
        assert key == "rover/resource/state"
        states = {"step": self.step, "epoch": "e", "states": {"wheels": f"after {self.step}"}}
        return [SimpleNamespace(ok=payload(states), err=None)]

    def declare_subscriber(self, key: str, callback: Any) -> str:
        self.hear = callback if callable(callback) else callback.callback
        return key


@pytest.fixture
def heard(monkeypatch: pytest.MonkeyPatch) -> tuple[Network, Any]:
    network = Network()
    handlers = SimpleNamespace(Callback=lambda hear, indirect: hear)
    monkeypatch.setattr(plain_client.zenoh, "handlers", handlers)
    return network, plain_client.Skill(network, "rover", "schema", "drive")


def status(after_step: int, **more: Any) -> dict[str, Any]:
    return {"goal_id": "g", "state": "RUNNING", "after_step": after_step, **more}


def step(number: int) -> dict[str, Any]:
    record = {"kind": "resource", "subject": "wheels", "after": f"after {number}"}
    return {"number": number, "epoch": "e", "records": [record]}


END = {"ending": "S", "success": True}


@pytest.mark.parametrize("lost", [False, True])
def test_a_status_that_comes_before_its_step_is_printed_after_it(
    capsys: pytest.CaptureFixture[str], heard: tuple[Network, Any], lost: bool
) -> None:
    network, client = heard
    network.step = 7
    late = [] if lost else [step(6), step(7)]
    for message in (status(7), *late, status(7, state="TERMINATED", terminal=END)):
        network.hear(payload(message))
    assert client.follow("g") == END
    lines = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    told = [each.get("step", each.get("state")) for each in lines]
    assert told == [5, 7, "RUNNING", "TERMINATED"]
    assert lines[1]["states"] == {"wheels": "after 7"}


def test_steps_in_order_are_printed_as_they_come(
    capsys: pytest.CaptureFixture[str], heard: tuple[Network, Any]
) -> None:
    network, client = heard
    for message in (step(6), step(6), status(6), step(7), status(7, state="TERMINATED", terminal=END)):
        network.hear(payload(message))
    client.follow("g")
    told = [json.loads(line).get("step", "status") for line in capsys.readouterr().out.splitlines()]
    assert told == [5, 6, "status", 7, "status"]


def test_a_state_that_is_older_than_the_last_one_is_not_printed(
    capsys: pytest.CaptureFixture[str], heard: tuple[Network, Any]
) -> None:
    """The reply to a start may come after statuses that were published later."""
    network, client = heard
    for state in ("RUNNING", "VALIDATING", "RUNNING"):
        network.hear(payload(status(5, state=state)))
    network.hear(payload(status(5, state="TERMINATED", terminal=END)))
    client.follow("g")
    told = [json.loads(line).get("state") for line in capsys.readouterr().out.splitlines()]
    assert told == [None, "RUNNING", "TERMINATED"]


class Time:
    """The time of a client that waits: it passes in its pauses and in its questions only."""

    def __init__(self) -> None:
        self.now = 100.0
        self.pauses: list[float] = []

    def monotonic(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        self.now += seconds
        self.pauses.append(seconds)


class LateManager:
    """A session whose question ends after `takes` seconds: by `silence`, and from `served_after` on by a reply."""

    def __init__(self, time: Time, silence: list[SimpleNamespace], *, takes: float, served_after: float) -> None:
        self._time, self._silence, self._takes = time, silence, takes
        self._served_at = time.now + served_after

    def get(self, key: str, **_: Any) -> list[SimpleNamespace]:
        if self._time.now >= self._served_at:
            return [SimpleNamespace(ok=payload({"asked": key}), err=None)]
        self._time.now += self._takes
        return self._silence


def refused(code: str) -> SimpleNamespace:
    message = payload({"code": code, "message": "It is not ready.", "help": ""})
    message.encoding = plain_client.REFUSAL
    return SimpleNamespace(ok=None, err=message)


SILENCES = pytest.mark.parametrize(
    ("silence", "takes"),
    [([], 0.0), ([refused("UNAVAILABLE")], 0.0), ([], plain_client.PATIENCE)],
    ids=["nobody serves the key", "unavailable", "hung"],
)


@SILENCES
def test_a_manager_that_is_started_again_answers_the_same_request(
    monkeypatch: pytest.MonkeyPatch, silence: list[SimpleNamespace], takes: float
) -> None:
    time = Time()
    monkeypatch.setattr(plain_client, "time", time)
    session = LateManager(time, silence, takes=takes, served_after=plain_client.SILENCE - 4.0)
    assert plain_client.ask(session, "rover/skill/drive/goal", {}) == {"asked": "rover/skill/drive/goal"}
    assert time.pauses[:3] == [0.05, 0.1, 0.2]
    assert max(time.pauses) <= 1.0


@SILENCES
def test_a_robot_that_stays_silent_counts_as_gone(
    monkeypatch: pytest.MonkeyPatch, silence: list[SimpleNamespace], takes: float
) -> None:
    time = Time()
    monkeypatch.setattr(plain_client, "time", time)
    begun = time.now
    with pytest.raises(plain_client.SilenceError):
        plain_client.ask(LateManager(time, silence, takes=takes, served_after=1000.0), "rover/skill/drive/goal", {})
    assert plain_client.SILENCE <= time.now - begun < plain_client.SILENCE + 3.0


@pytest.mark.parametrize("replies", [0, 2, 1000])
def test_a_goal_that_its_manager_does_not_know_is_lost_after_its_release(
    capsys: pytest.CaptureFixture[str],
    heard: tuple[Network, Any],
    monkeypatch: pytest.MonkeyPatch,
    replies: int,
) -> None:
    """replies: number of replies of the resource manager that the goal still holds its grant."""
    _, client = heard
    asked: list[str] = []

    def ask(session: Network, key: str, request: dict[str, Any]) -> dict[str, Any]:
        asked.append(key)
        if key == "rover/skill/drive/goal":
            refusal = {"message": "`drive` knows of no goal g.", "help": "Start one.", "code": "UNKNOWN_GOAL"}
            raise plain_client.RefusedError(refusal)
        if key == "rover/resource/ready":
            held = asked.count(key) <= replies
            session.step = 6 if held else 7
            return {"skills": [{"skill": "drive", "running": {"goal_id": "g"} if held else None}]}
        return {"step": session.step, "epoch": "e", "states": {"wheels": f"after {session.step}"}}

    monkeypatch.setattr(plain_client, "ask", ask)
    monkeypatch.setattr(plain_client, "PATIENCE", 0.01)
    monkeypatch.setattr(plain_client, "PAUSE", 0.0)
    terminal = client.follow("g")
    assert (terminal["ending"], terminal["success"]) == ("LOST", False)
    assert terminal["reason"].endswith("may still be taken.") == (replies > plain_client.HELD)
    assert asked[1:] == ["rover/resource/ready"] * min(replies + 1, plain_client.HELD) + ["rover/resource/state"]
    states, end = (json.loads(line) for line in capsys.readouterr().out.splitlines()[1:])
    assert states["step"] == (6 if replies > plain_client.HELD else 7)
    assert end["terminal"] == terminal
