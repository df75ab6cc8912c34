"""Options of a run from the environment, and their effect on missions."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pytest

from skillwing.m600.robot import ROBOT
from skillwing.services.client.connection import find_target
from skillwing.services.errors import InvalidOptionError
from skillwing.services.processes.run_options import run_options
from skillwing.services.processes.run_state import announced
from skillwing.services.terminal.connection import mission_context

ENVIRONMENT = {
    "SKILLWING_SEED": "7",
    "SKILLWING_WORLD": "inspection",
    "SKILLWING_LINK": '{"shadow": true}',
    "SKILLWING_SCENARIO": "/scenario.toml",
    "SKILLWING_FAULTS": "",
    "SKILLWING_CONNECT": "tcp/127.0.0.1:1",
}


@pytest.fixture(autouse=True)
def own_environment(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for variable in [name for name in os.environ if name.startswith("SKILLWING_")]:
        monkeypatch.delenv(variable)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))


def test_options_of_a_run_are_read_and_empty_ones_count_for_nothing() -> None:
    expected: dict[str, Any] = {
        "seed": 7,
        "world": "inspection",
        "link": {"shadow": True},
        "scenario": "/scenario.toml",
    }
    assert run_options(ENVIRONMENT) == expected


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("SEED", "one"),
        ("SEED", "-1"),
        ("SEED", "4294967296"),
        ("SEED", "9" * 5000),
        ("LINK", "shadow"),
        ("FAULTS", "["),
        ("SPEED", "-1"),
        ("SPEED", "nan"),
    ],
)
def test_an_option_that_means_nothing_is_named(name: str, text: str) -> None:
    with pytest.raises(InvalidOptionError, match=f"SKILLWING_{name} is "):
        run_options({f"SKILLWING_{name}": text})


@pytest.mark.parametrize(("text", "factor"), [("max", 0.0), ("2", 2.0)])
def test_a_pace_is_given_as_to_the_command_line(text: str, factor: float) -> None:
    assert run_options({"SKILLWING_SPEED": text}) == {"speed": factor}


def test_a_mission_gets_the_place_that_up_has_left(tmp_path: Path) -> None:
    known = ROBOT.mission_options({"world": "inspection", "seed": 7})
    with announced(ROBOT, "tcp/127.0.0.1:1", tmp_path, mission_context=known):
        told = mission_context(find_target(), "inspection")
        assert told["radius"] == known["inspection"]["radius"]
        assert told.keys() == known["inspection"].keys()
        assert mission_context(find_target(), "another") == {}


def test_a_mission_gets_the_same_from_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in ENVIRONMENT.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setenv("SKILLWING_ROBOT", "m600")
    assert (
        mission_context(find_target(), "inspection")
        == ROBOT.mission_options({"world": "inspection", "seed": 7})["inspection"]
    )
