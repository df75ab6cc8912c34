"""docs/cli.md has every command, says which print JSON, and gives the exit codes of the code."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import typer
from typer.main import get_command
from typer.testing import CliRunner

from skillwing.services.processes import lifetime
from skillwing.services.terminal import cli, exit_codes

PAGE = (Path(__file__).parents[3] / "docs" / "cli.md").read_text(encoding="utf-8")
TABLE = PAGE.partition("| command | does |")[2].partition("\n\n")[0]
ROWS = [line.split(" | ")[0].strip("| ") for line in TABLE.splitlines()[2:]]
CODES = {int(code): what for code, what in re.findall(r"^\| (\d+) \| (.*) \|$", PAGE, re.MULTILINE)}


def commands() -> Iterator[tuple[str, Any]]:
    """Every command by its words, and those of a command that has some."""
    group: Any = get_command(cli.app)
    context = typer.Context(group)
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        inner = getattr(command, "commands", {})
        yield from ((f"{name} {each}", inner[each]) for each in inner)
        if not inner:
            yield name, command


COMMANDS = dict(commands())


@pytest.mark.parametrize("words", COMMANDS)
def test_each_command_has_a_row_and_takes_help(words: str) -> None:
    assert any(re.search(rf"`{words}[ `]", row) for row in ROWS)
    shown = CliRunner().invoke(cli.app, [*words.split(), "--help"])
    assert shown.exit_code == 0
    assert "Usage:" in shown.stdout


def test_each_row_is_a_command() -> None:
    named = {name for row in ROWS for name in re.findall(r"`([a-z][a-z-]*)", row)}
    assert named == {words.split()[0] for words in COMMANDS}


def test_the_commands_with_json_are_those_that_the_page_names() -> None:
    told = re.search(r"These take `--json`: (.*?)\.\n", PAGE, re.DOTALL)
    assert told is not None
    takers = {words for words, command in COMMANDS.items() if any("--json" in each.opts for each in command.params)}
    assert set(re.findall(r"`([^`]+)`", told[1])) == takers


def test_the_exit_codes_are_those_of_the_code() -> None:
    constants = exit_codes.OK, exit_codes.FAILED, exit_codes.USAGE, exit_codes.NO_SYSTEM, exit_codes.REFUSED
    assert set(CODES) == {*constants, exit_codes.INTERRUPTED}


def test_the_exit_codes_of_processes_are_those_of_the_code() -> None:
    _, _, said = PAGE.partition("Their exit codes:")
    told = {int(code) for code in re.findall(r"(?:^|, )\s*(\d+) ", said)}
    assert told == {value for name, value in vars(lifetime).items() if name.startswith("EXIT_")}


@pytest.mark.parametrize("words", [words for words, command in COMMANDS.items() if "Exit codes:" in command.help])
def test_a_command_names_no_other_exit_code(words: str) -> None:
    _, _, said = COMMANDS[words].help.partition("Exit codes:")
    codes = {int(code) for code in re.findall(r"(?:^|, |; )\s*(\d+) ", said)}
    assert codes
    assert codes <= set(CODES)
