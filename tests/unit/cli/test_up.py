"""Options of `skillwing up`."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from typer.main import get_command

from skillwing.m600.robot import SKILLSET
from skillwing.services.processes.process_state import ProcessState
from skillwing.services.processes.run_state import announced
from skillwing.services.robot import Robot
from skillwing.services.terminal import cli
from skillwing.services.terminal.exit_codes import FAILED, OK, USAGE
from skillwing.services.terminal.system_runner import run_detached, running_processes
from skillwing.sim_mujoco.world.standing import MOST_DRONES


class LaunchedError(Exception):
    """Instead of a process: its command."""


@pytest.fixture
def launched(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Any:
    """Calls a command line and returns the words of the process that it launches."""

    def popen(command: list[str], **options: Any) -> None:
        raise LaunchedError(command)

    def call(*words: str) -> list[str]:
        monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
        monkeypatch.setattr(subprocess, "Popen", popen)
        monkeypatch.setattr("sys.argv", ["skillwing", *words])
        with pytest.raises(LaunchedError) as caught:
            cli.main()
        return caught.value.args[0]

    return call


def test_up_counts_what_lives() -> None:
    states = [ProcessState(name=name) for name in ("router", "data_manager", "skill/go")]
    assert running_processes(states) == "2"
    assert running_processes([*states, ProcessState(name="skill/refill", life="waits")]) == "2 of 3"


@pytest.mark.parametrize(
    ("processes", "code", "told"),
    [
        ((ProcessState(name="skill/go"),), OK, []),
        (
            (
                ProcessState(name="skill/go"),
                ProcessState(name="skill/wave", life="given up", last_words="It is broken."),
            ),
            FAILED,
            ["1 of 2 processes run.", "It is broken."],
        ),
    ],
)
def test_what_runs_detached_tells_what_is_down_as_it_does_in_the_foreground(
    processes: tuple[ProcessState, ...],
    code: int,
    told: list[str],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.setattr(subprocess, "Popen", lambda *_, **__: SimpleNamespace(pid=os.getpid()))
    robot = Robot("rover", SKILLSET, {}, clock="wall")
    with announced(robot, "tcp/127.0.0.1:1", tmp_path, processes=processes):
        assert run_detached("rover", ["up"], tmp_path) == code
    said = capsys.readouterr()
    assert "rover runs as process" in said.out
    assert said.err.splitlines() == told


def up_options(words: list[str]) -> dict[str, Any]:
    """The options of `up` that words stand for."""
    up = cli.LazyGroup.get_command(get_command(cli.app), None, "up")  # pyright: ignore[reportArgumentType]
    return up.make_context("up", words).params


@pytest.mark.parametrize("flags", [["-dr", "m600"], ["-d"], ["--detach", "-r", "m600"], ["-r", "m600", "-d"]])
def test_the_detached_process_does_not_detach(launched: Any, tmp_path: Path, flags: list[str]) -> None:
    command = launched("up", *flags, "--mock", "--seed", "7", "--speed", "2", "--run-dir", str(tmp_path / "run"))
    module = command.index("skillwing.services.terminal.cli")
    assert command[module + 1] == "up"
    given = up_options(command[module + 2 :])
    assert given["detach"] is False
    assert (given["robot"], given["mock"], given["seed"], given["speed"]) == ("m600", True, 7, 2.0)
    assert given["run_dir"] == tmp_path / "run"


def test_the_detached_process_mocks_the_same_skills(launched: Any, tmp_path: Path) -> None:
    script = SKILLSET.with_name("camera_fails.mock.toml")
    words = ["up", "-d", "--mock", "goto", "hover", "--script", str(script), "--run-dir", str(tmp_path / "run")]
    command = launched(*words)
    given = up_options(command[command.index("skillwing.services.terminal.cli") + 2 :])
    assert (list(given["mocked"]), given["mock"], Path(given["script"])) == (["goto", "hover"], True, script)
    assert given["seed"] is None


def test_the_detached_process_is_laid_out_the_same(launched: Any, tmp_path: Path) -> None:
    words = ["--mock", "--colocate", "--topology", "mesh", "--router", "tcp/127.0.0.1:7447", "--robot-name", "second"]
    command = launched("up", "-d", *words, "--run-dir", str(tmp_path / "run"))
    given = up_options(command[command.index("skillwing.services.terminal.cli") + 2 :])
    assert (given["colocate"], given["topology"]) == (True, "mesh")
    assert (given["router"], given["robot_name"]) == ("tcp/127.0.0.1:7447", "second")


def test_the_detached_process_has_the_same_scenario(launched: Any, tmp_path: Path) -> None:
    scenario = tmp_path / "gusts.toml"
    scenario.touch()
    command = launched("up", "-d", "--scenario", str(scenario), "--run-dir", str(tmp_path / "run"))
    given = up_options(command[command.index("skillwing.services.terminal.cli") + 2 :])
    assert Path(given["scenario"]) == scenario


def test_the_detached_process_has_the_same_world(launched: Any, tmp_path: Path) -> None:
    command = launched("up", "-d", "--world", "village", "--run-dir", str(tmp_path / "run"))
    assert up_options(command[command.index("skillwing.services.terminal.cli") + 2 :])["world"] == "village"


@pytest.mark.parametrize(
    ("words", "robots", "world_of"),
    [
        (["--with", "right", "--with", "third"], ["right", "third"], None),
        (["--world-of", "left", "--router", "tcp/127.0.0.1:7447"], [], "left"),
    ],
)
def test_the_detached_process_shares_the_same_world(
    launched: Any, tmp_path: Path, words: list[str], robots: list[str], world_of: str | None
) -> None:
    command = launched("up", "-d", "--robot-name", "mine", *words, "--run-dir", str(tmp_path / "run"))
    given = up_options(command[command.index("skillwing.services.terminal.cli") + 2 :])
    assert (list(given["beside"] or ()), given["world_of"]) == (robots, world_of)


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--world", "moon"], "There is no world of kind 'moon'; known are courtyard,"),
        (["--mock", "--world", "village"], "Name the skills to mock"),
        (["goto"], "Write `up --mock goto`."),
        (["--mock", "gotoo"], "did you mean `goto`?"),
        (["--script", "x.toml"], "Write `up --mock --script FILE`."),
        (["--mock", "--script", "no_such.toml"], "`no_such.toml` cannot be used"),
        (["--scenario", "no_such.toml"], "There is no scenario file no_such.toml."),
        (["--mock", "--scenario", "x.toml"], "Name the skills to mock"),
        (["--mock", "--robot-name", "a b"], "A robot cannot be called `a b`."),
        (["--mock", "--with", "right"], "Name the skills to mock"),
        (["--with", "a b"], "A robot cannot be called `a b`."),
        (["--robot-name", "left", "--with", "left"], "this one is `left`"),
        (["--with", "right", "--with", "right"], "Each robot in a simulator has a name of its own"),
        (["--world-of", "left"], "Give `--router`, and no `--with`."),
        (["--world-of", "left", "--router", "tcp/127.0.0.1:1", "--with", "right"], "and no `--with`."),
        ([word for number in range(MOST_DRONES) for word in ("--with", f"r{number}")], "There is room for 7 drones"),
        (["--mock", "--router", "tcp/127.0.0.1:1", "--listen", "tcp/127.0.0.1:2"], "Leave out `--listen`."),
    ],
)
def test_a_typing_error_in_the_command_starts_nothing(
    words: list[str], sentence: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.argv", ["skillwing", "up", *words])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert ended.value.code == USAGE
    assert sentence in capsys.readouterr().err


@pytest.mark.parametrize("command", ["up", "demo"])
def test_all_problems_of_a_scenario_are_reported_before_anything_starts(
    command: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scenario = tmp_path / "windy.toml"
    scenario.write_text('wnd = 3\n[[fault]]\nsed = "zed"\nkind = "freeze"\nat = "soon"\n', encoding="utf-8")
    monkeypatch.setattr("sys.argv", ["skillwing", command, "--scenario", str(scenario)])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert ended.value.code == USAGE
    first, *wrong, last = capsys.readouterr().err.splitlines()
    assert first.endswith("does not fit:")
    assert [line.split("`")[1] for line in wrong] == ["wnd", "sed", "sensor", "at"]
    assert last == "docs/sensors.md describes the format."


@pytest.mark.parametrize("speed", ["0", "0.01", "-1", "nan"])
def test_a_speed_that_no_clock_keeps_is_refused(
    speed: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.argv", ["skillwing", "up", "--speed", speed])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert ended.value.code == USAGE
    assert "speed" in capsys.readouterr().err


@pytest.mark.parametrize("flags", [[], ["--detach"]])
def test_a_directory_that_cannot_be_made_gets_a_sentence(
    flags: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    directory = str(tmp_path / "file" / "run")
    monkeypatch.setattr("sys.argv", ["skillwing", "up", "--mock", *flags, "--run-dir", directory])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    said = capsys.readouterr().err
    assert ended.value.code == USAGE
    assert directory in said
    assert len(said.splitlines()) == 1


@pytest.mark.parametrize("option", ["--world", "--scenario"])
def test_a_robot_without_a_simulator_has_no_world(
    option: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("skillwing.services.commands.up.find_robot", lambda name: Robot("rover", SKILLSET, {}))
    monkeypatch.setattr("sys.argv", ["skillwing", "up", option, "village"])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert ended.value.code == USAGE
    assert "this robot has none. Leave it out." in capsys.readouterr().err
