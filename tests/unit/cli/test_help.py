"""Content and cost of `skillwing --help`."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from importlib.metadata import EntryPoint, version
from pathlib import Path

import pytest
from typer.testing import CliRunner

from skillwing.services.errors import InvalidOptionError
from skillwing.services.terminal import cli
from skillwing.services.terminal.exit_codes import USAGE, exit_code_of

COMMANDS = cli.command_entries()
HEAVY = {"rich", "pygments", "markdown_it", "numpy", "zenoh", "msgspec"}
"""Modules of other commands, which take longer to load than the list to print."""


@pytest.fixture(scope="module")
def listed() -> dict[str, str]:
    """Each command of the list with the beginning of what is said of it."""
    shown = CliRunner().invoke(cli.app, ["--help"], env={"COLUMNS": "200"}).stdout
    _, _, listed = shown.partition("Commands:\n")
    words = [line.split(maxsplit=1) for line in listed.splitlines() if re.match(r" {2}\S", line)]
    return {name: text for name, *rest in words for text in rest}


def test_the_version_is_that_of_the_package() -> None:
    said = CliRunner().invoke(cli.app, ["--version"])
    assert (said.exit_code, said.stdout) == (0, f"skillwing {version('skillwing')}\n")


@pytest.mark.parametrize("entry", COMMANDS.values(), ids=lambda entry: entry.name)
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
    assert all(f"`{name}`" in str(caught.value) for name in COMMANDS)
    assert exit_code_of(caught.value) == USAGE


def test_the_list_asks_once_what_is_installed(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[str] = []

    def counted(*, group: str) -> list[EntryPoint]:
        asked.append(group)
        return []

    monkeypatch.setattr(cli, "entry_points", counted)
    cli.command_entries.cache_clear()
    try:
        assert CliRunner().invoke(cli.app, ["--help"]).exit_code == 0
    finally:
        cli.command_entries.cache_clear()
    assert asked == [cli.GROUP]


def test_each_file_of_the_folder_is_a_command() -> None:
    folder = Path(cli.__file__).parents[1] / "commands"
    files = {path.stem.replace("_", "-") for path in folder.glob("*.py")} - {"--init--"}
    assert files <= set(COMMANDS), "each file needs a name that begins with a lower-case letter"
    assert {"up", "start"} <= files


def test_a_command_that_is_declared_and_not_installed_says_how_to_install_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert "holders" not in cli.command_entries()
    (tmp_path / "pyproject.toml").write_text('[project.entry-points."skillwing.commands"]\nholders = "a:b"\n')
    info = tmp_path / "skillwing-9.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: skillwing\nVersion: 9\n")
    (info / "direct_url.json").write_text(json.dumps({"url": tmp_path.as_uri(), "dir_info": {"editable": True}}))
    monkeypatch.syspath_prepend(str(tmp_path))
    with pytest.raises(InvalidOptionError) as caught:
        CliRunner().invoke(cli.app, ["holders"], catch_exceptions=False)
    declared = f"`skillwing holders` is declared in {tmp_path}/pyproject.toml and not installed yet."
    assert str(caught.value).startswith(f"{declared} Install it: `make setup`")
