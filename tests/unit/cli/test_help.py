"""What `skillwing --help` shows, and what it costs."""

from __future__ import annotations

import re
import subprocess
import sys
from importlib.metadata import EntryPoint, EntryPoints, entry_points

import pytest
from typer.testing import CliRunner

from skillwing.services.errors import InvalidOptionError
from skillwing.services.terminal import cli
from skillwing.services.terminal.exit_codes import USAGE, exit_code_of

COMMANDS = entry_points(group=cli.COMMANDS)
HEAVY = {"rich", "pygments", "markdown_it", "numpy", "zenoh", "msgspec"}
"""What other commands need, and takes longer to load than a list to be shown."""


@pytest.fixture(scope="module")
def listed() -> dict[str, str]:
    """Each command of the list with the beginning of what is said of it."""
    shown = CliRunner().invoke(cli.app, ["--help"], env={"COLUMNS": "200"}).stdout
    _, _, listed = shown.partition("Commands:\n")
    words = [line.split(maxsplit=1) for line in listed.splitlines() if re.match(r" {2}\S", line)]
    return {name: text for name, *rest in words for text in rest}


@pytest.mark.parametrize("entry", COMMANDS, ids=lambda entry: entry.name)
def test_the_list_says_what_each_command_says_of_itself(entry: EntryPoint, listed: dict[str, str]) -> None:
    target = entry.load()
    said = target.info.help if hasattr(target, "info") else target.__doc__
    assert said.startswith(listed[entry.name][:40])


def test_the_list_imports_no_command() -> None:
    script = "import sys; sys.argv[1:] = ['--help']\nfrom skillwing.services.terminal.cli import main\n"
    script += "try:\n    main()\nfinally:\n    print(*sys.modules)"
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    imported = set(run.stdout.splitlines()[-1].split())
    assert {name for name in imported if name.startswith("skillwing.")} == {
        "skillwing.services",
        "skillwing.services.terminal",
        "skillwing.services.terminal.cli",
    }
    assert imported.isdisjoint(HEAVY)


def test_a_command_that_does_not_exist_is_answered_with_all_that_do() -> None:
    with pytest.raises(InvalidOptionError) as caught:
        CliRunner().invoke(cli.app, ["stauts"], catch_exceptions=False)
    assert str(caught.value).startswith("There is no command `stauts`; did you mean `status`? What exists: ")
    assert all(f"`{name}`" in str(caught.value) for name in COMMANDS.names)
    assert exit_code_of(caught.value) == USAGE


def test_the_list_asks_once_what_is_installed(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[str] = []

    def counted(*, group: str) -> EntryPoints:
        asked.append(group)
        return COMMANDS

    monkeypatch.setattr(cli, "entry_points", counted)
    cli._entries.cache_clear()  # pyright: ignore[reportPrivateUsage]
    assert CliRunner().invoke(cli.app, ["--help"]).exit_code == 0
    assert asked == [cli.COMMANDS]
