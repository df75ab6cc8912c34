"""docs/cli.md has the table of all commands, as they are, and the exit codes of the code."""

from __future__ import annotations

import re

import pytest
from cli_page import DOCS, MARKS, PAGE, command_table, commands
from typer.testing import CliRunner

from skillwing.services.processes import lifetime
from skillwing.services.terminal import cli, exit_codes

COMMANDS = dict(commands())
TEXT = PAGE.read_text(encoding="utf-8")
CODES = {int(code) for code in re.findall(r"^\| (\d+) \| .* \|$", TEXT, re.MULTILINE)}


@pytest.mark.parametrize("words", COMMANDS)
def test_each_command_takes_help(words: str) -> None:
    shown = CliRunner().invoke(cli.app, [*words.split(), "--help"])
    assert shown.exit_code == 0
    assert "Usage:" in shown.stdout


def test_the_table_has_the_commands_as_they_are() -> None:
    assert MARKS.read(PAGE) == command_table(), "docs/cli.md is older than the commands. Run `make generate`."


@pytest.mark.parametrize("words", COMMANDS)
def test_the_pages_that_the_help_names_exist(words: str) -> None:
    missing = [page for page in DOCS.findall(COMMANDS[words].help) if not (PAGE.parent / page).exists()]
    assert missing == [], f"The help of `skillwing {words}` names pages that are not in docs/. Name others."


def test_the_exit_codes_are_those_of_the_code() -> None:
    assert {value for value in vars(exit_codes).values() if isinstance(value, int)} == CODES


def test_the_exit_codes_of_processes_are_those_of_the_code() -> None:
    _, _, listed = TEXT.partition("Their exit codes:")
    found = {int(code) for code in re.findall(r"(?:^|; )\s*(\d+) ", listed)}
    assert found == {value for name, value in vars(lifetime).items() if name.startswith("EXIT_")}


@pytest.mark.parametrize("words", [words for words, command in COMMANDS.items() if "Exit codes:" in command.help])
def test_a_command_names_no_other_exit_code(words: str) -> None:
    _, _, listed = COMMANDS[words].help.partition("Exit codes:")
    codes = {int(code) for code in re.findall(r"(?:^|, |; )\s*(\d+) ", listed)}
    assert codes
    assert codes <= CODES
