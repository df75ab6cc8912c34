"""`skillwing mock` and `skillwing script` with real processes, for a robot that is not installed."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest
from command_line import Command

from skillwing.services.terminal.exit_codes import FAILED, OK, REFUSED, USAGE

pytestmark = pytest.mark.slow

PATIENCE = 60.0
PUMP = """
skillset pump {
    data { pressure: float64 [Pa] period=0.2 }
    resource valve { initial SHUT  extern SHUT -> OPEN  extern OPEN -> SHUT }
    skill fill {
        progress=0.1 { level: float64 }
        input { to: float64 in 0.0..1.0 }
        output { level: float64 }
        precondition { open: resource=(valve == OPEN)  strong: data=(pressure > 100.0) }
        result { success FULL  failure LEAK }
    }
    skill drain { result { success EMPTY } }
}
"""
SCRIPT = """
[skill.fill]
delay = 0.3
output = {level = {input = "to"}}
[resources]
valve = "OPEN"
"""


@pytest.fixture(scope="module")
def pump(skillwing: Command, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Command]:
    """A mocked pump, the script beside its skillset. Afterwards none of its processes is left."""
    folder = tmp_path_factory.mktemp("pump")
    (folder / "pump.skillset").write_text(PUMP, encoding="utf-8")
    (folder / "pump.mock.toml").write_text(SCRIPT, encoding="utf-8")
    said = skillwing("mock", str(folder / "pump.skillset"), "--detach", "--no-record", "--run-dir", str(folder / "run"))
    assert said.code == OK, said.error
    processes = psutil.Process(skillwing("status", "--json").json["pid"]).children()
    try:
        yield skillwing
    finally:
        assert skillwing("down").code == OK
        assert psutil.wait_procs(processes, timeout=PATIENCE)[1] == []


def test_every_manager_is_a_process(pump: Command) -> None:
    status = pump("status", "--json").json
    assert (status["robot"], status["mock"]) == ("pump", True)
    assert list(status["processes"]) == [
        "router",
        "data_manager",
        "resource_manager",
        "skill/fill",
        "skill/drain",
        "mocked_world",
    ]
    assert {process["state"] for process in status["processes"].values()} == {"runs"}
    assert status["resources"] == {"valve": "OPEN"}


def test_a_skill_does_what_the_script_beside_the_skillset_says(pump: Command) -> None:
    said = pump("start", "fill", "to=0.5", "--follow", "--json")
    assert said.code == OK, said.error
    assert said.json["terminal"]["output"] == {"level": 0.5}


def test_the_world_publishes_data_with_which_skills_can_start(pump: Command) -> None:
    reading = pump("data", "pressure", "--json").json
    assert reading["value"] > 100.0
    assert reading["stale"] is False


def test_the_script_is_shown_and_changed(pump: Command) -> None:
    assert pump("script", "fill", "result=LEAK", "delay=0.1").code == OK
    shown = pump("script", "--json").json["skills"]["fill"]
    assert shown["given"] == [{"result": "LEAK", "delay": 0.1}]
    assert "LEAK after 0.1 s" in pump("script").out
    assert pump("start", "fill", "to=0.5", "--follow").code == FAILED
    assert pump("start", "fill", "to=0.5", "--follow").code == OK


def test_data_are_changed_and_changed_back(pump: Command) -> None:
    assert pump("script", "pressure", "value=50").code == OK
    said = pump("start", "fill", "to=0.5")
    assert said.code == REFUSED
    assert "pressure" in said.out
    assert pump("script", "--reset").code == OK
    assert pump("start", "fill", "to=0.5", "--follow").code == OK


def test_the_goal_that_runs_is_changed(pump: Command) -> None:
    assert pump("script", "drain", "forever=true").code == OK
    assert pump("start", "drain").code == OK
    assert pump("script", "drain", "result=EMPTY", "--now").code == OK
    assert pump("interrupt", "drain").code == FAILED
    assert pump("script", "drain", "result=EMPTY", "--now").code == REFUSED


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["script", "fil"], "did you mean `fill`?"),
        (["script", "fill", "result=LEEK"], "did you mean `LEAK`?"),
        (["script", "fill", "dely=1"], "did you mean `delay`?"),
        (["script", "fill", "delay"], "Write KEY=VALUE"),
        (["script", "fill", "--always"], "Give what --always changes"),
        (["script", "fill", "delay=1", "--always", "--now"], "Give one of"),
        (["script", "pressure", "value=high"], "it takes a finite number"),
        (["script", "--next"], "Name what to change"),
        (["mock", "no_such.skillset"], "`no_such.skillset` cannot be used"),
    ],
)
def test_a_typing_error_is_answered_in_a_sentence(pump: Command, words: list[str], sentence: str) -> None:
    said = pump(*words)
    assert said.code == USAGE
    assert sentence in said.error
    assert "Traceback" not in said.error


def test_a_broken_script_starts_nothing(skillwing: Command, tmp_path: Path) -> None:
    file, script = tmp_path / "pump.skillset", tmp_path / "s.toml"
    file.write_text(PUMP, encoding="utf-8")
    script.write_text("[skill.fil]\n[data]\npresure = 1\n", encoding="utf-8")
    said = skillwing("mock", str(file), "--script", str(script), "--robot-name", "other")
    assert said.code == USAGE
    assert "`fill`" in said.error
    assert "`pressure`" in said.error


def test_a_crash_loses_the_goal_and_the_manager_is_started_again(pump: Command) -> None:
    assert pump("script", "drain", "crash=true", "delay=0.1").code == OK
    said = pump("start", "drain", "--follow")
    assert said.code == FAILED
    assert "LOST" in said.out
    assert pump("start", "fill", "to=0.5", "--follow").code == OK
    deadline = time.monotonic() + PATIENCE
    while (drain := pump("status", "--json").json["processes"]["skill/drain"])["state"] != "runs":
        assert time.monotonic() < deadline, drain
    assert drain["restarts"] == 1
    assert pump("start", "drain", "--follow").code == OK
