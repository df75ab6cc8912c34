"""Option `--robot` in the commands that messages advise."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from typer.main import get_command

from skillwing.bt_missions.cli.mission_robots import addressed_text
from skillwing.dsl import load
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.client.target import Target
from skillwing.services.errors import NoGoalError
from skillwing.services.processes.run_state import RunState, started, write_run_state
from skillwing.services.robot import find_robot
from skillwing.services.terminal import cli
from skillwing.services.terminal.connection import System, addressed
from skillwing.services.terminal.robot_option import ROBOT_COMMANDS, named_robot, with_robot


@pytest.fixture(autouse=True)
def own_runtime_dir(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.delenv("SKILLWING_CONNECT", raising=False)


def announce(robot: str) -> None:
    write_run_state(
        RunState(
            robot=robot,
            endpoint="tcp/127.0.0.1:1",
            skillset="m600.skillset",
            clock="wall",
            pid=os.getpid(),
            pid_started=started(os.getpid()) or "",
            run_dir="runs/x",
        )
    )


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("Use `skillwing start land`.", "Use `skillwing start land --robot left`."),
        ("`skillwing mission abort` ends it.", "`skillwing mission abort --robot left` ends it."),
        ("after `skillwing start a`, or `skillwing trigger b IN_AIR`",
         "after `skillwing start a --robot left`, or `skillwing trigger b IN_AIR --robot left`"),
        ("`skillwing down --robot right` stops it.", "`skillwing down --robot right` stops it."),
        ("`skillwing down -r right` stops it.", "`skillwing down -r right` stops it."),
        ("Start one with `skillwing up`.", "Start one with `skillwing up`."),
        ("`skillwing runs list` has its result.", "`skillwing runs list` has its result."),
        ("skillwing start land", "skillwing start land"),
    ],
)  # fmt: skip
def test_commands_in_backticks_choose_the_robot_once(text: str, expected: str) -> None:
    assert with_robot(text, "left") == expected
    assert with_robot(expected, "left") == expected
    assert with_robot(text, None) == text


def commands(group: Any, prefix: str = "") -> Iterator[tuple[str, Any]]:
    for name, command in group.commands.items():
        yield f"{prefix}{name}", command


def test_the_list_of_commands_is_that_of_all_with_the_option() -> None:
    group: Any = get_command(cli.app)
    found: set[str] = set()
    for name in cli.command_entries():
        command = group.get_command(group.make_context("skillwing", [], resilient_parsing=True), name)
        for full, each in commands(command, f"{name} ") if hasattr(command, "commands") else [(name, command)]:
            helps = [option.help or "" for option in each.params if "--robot" in option.opts]
            if any(text.startswith("Running robot") for text in helps):
                found.add(full)
    assert found - {"mission list"} == ROBOT_COMMANDS - {"mission list"}


@pytest.mark.parametrize(
    ("words", "robot"),
    [
        (["start", "land", "--robot", "left"], "left"),
        (["start", "land", "--robot=left"], "left"),
        (["mission", "abort", "-r", "left"], "left"),
        (["mission", "run", "a.xml", "--robot", "drone=left"], None),
        (["start", "land"], None),
        (["start", "land", "--robot"], None),
        (["start", "land", "--", "--robot", "left"], None),
        (["up", "--robot", "./yard"], None),
        ([], None),
    ],
)
def test_the_robot_of_a_command_line(words: list[str], robot: str | None) -> None:
    assert named_robot(words) == robot


def test_a_remedy_has_the_robot_among_several_systems_or_if_the_command_had_it() -> None:
    announce("left")
    assert addressed("`skillwing status`", "left", named=False) == "`skillwing status`"
    assert addressed("`skillwing status`", "left", named=True) == "`skillwing status --robot left`"
    announce("right")
    assert addressed("`skillwing status`", "left", named=False) == "`skillwing status --robot left`"


def test_an_error_of_a_command_has_its_robot(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fail() -> None:
        raise NoGoalError("goto")

    monkeypatch.setattr(cli, "app", fail)
    monkeypatch.setattr(sys, "argv", ["skillwing", "interrupt", "goto", "--robot", "left"])
    with pytest.raises(SystemExit):
        cli.main()
    assert "`skillwing status --robot left` shows what is." in capsys.readouterr().err


def test_a_status_of_a_mission_on_several_robots_names_the_one_that_it_begins_with(m600_target: Target) -> None:
    system = System(m600_target, InProcessNetwork().bus("cli"), load(m600_target.skillset), named=True)  # pyright: ignore[reportArgumentType]
    names = {"drone": "right", "yard": "yard"}
    text = "nobody commands it. Use `skillwing start land`."
    assert addressed_text(f"drone: {text}", system, names) == f"drone: {with_robot(text, 'right')}"
    assert addressed_text(text, system, names) == with_robot(text, system.target.robot)


@pytest.fixture
def m600_target() -> Target:
    return Target("left", "tcp/127.0.0.1:1", find_robot("m600").skillset, "wall")
