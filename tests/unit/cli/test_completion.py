"""Shell completion without a running system: names of the robot that `up` starts."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from skillwing.dsl import parse
from skillwing.m600.robot import ROBOT
from skillwing.services.terminal import cli, completion

SKILLSET = ROBOT.load_skillset()
SKILLS = {skill.name for skill in SKILLSET.skills}
DATA = {datum.name for datum in SKILLSET.data}
RESOURCES = {resource.name for resource in SKILLSET.resources}


@pytest.fixture(autouse=True)
def nothing_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))


def offered(line: str, shell: str = "bash") -> set[str]:
    """Completions of the last word of the line."""
    words = {"COMP_WORDS": line, "COMP_CWORD": str(len(line.split(" ")) - 1), "_TYPER_COMPLETE_ARGS": line}
    result = CliRunner().invoke(
        cli.app, [], prog_name="skillwing", env={"_SKILLWING_COMPLETE": f"complete_{shell}", **words}
    )
    return set(result.stdout.split())


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("skillwing tim", {"timeline"}),
        ("skillwing start ", SKILLS),
        ("skillwing start tak", {"takeoff"}),
        ("skillwing start takeoff h", {"height="}),
        ("skillwing start takeoff height=3 ", {"speed="}),
        ("skillwing interrupt goto_", {"goto_straight"}),
        ("skillwing data ", DATA),
        ("skillwing trigger ", RESOURCES),
        ("skillwing trigger SDK_authority ", {"AVAILABLE", "UNAVAILABLE"}),
        ("skillwing trigger axes_authority ", set[str]()),
        ("skillwing script ", SKILLS | DATA),
        ("skillwing up --mock hov", {"hover"}),
        ("skillwing up --robot m", {"m600", "m600-mocks"}),
        ("skillwing campaign ma", {"mapping"}),
        ("skillwing fault l", set[str]()),
        ("skillwing pilot ", {"take", "give"}),
        ("skillwing start --robot nobody ", set[str]()),
    ],
)
def test_names_are_offered(line: str, expected: set[str]) -> None:
    assert offered(line) == expected


LIFT = parse("""
skillset truck {
    enum Mode { SLOW FAST }
    skill lift { input { mode: Mode  gently: bool  height: float64 } result { success UP } }
}
""")


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("skillwing start lift m", {"mode="}),
        ("skillwing start lift mode=", {"mode=SLOW", "mode=FAST"}),
        ("skillwing start lift mode=F", {"mode=FAST"}),
        ("skillwing start lift gently=t", {"gently=true"}),
        ("skillwing start lift height=", set[str]()),
        ("skillwing start lift nothing=", set[str]()),
        # bash makes three words of NAME=VALUE.
        ("skillwing start lift mode =", {"SLOW", "FAST"}),
        ("skillwing start lift mode = S", {"SLOW"}),
        ("skillwing start lift height = 1", set[str]()),
    ],
)
def test_values_of_inputs_are_offered(line: str, expected: set[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(completion, "_skillset", lambda ctx: LIFT)
    assert offered(line) == expected


@pytest.mark.parametrize(
    ("word", "expected"),
    [
        ("survey", {"survey.xml", "survey.py"}),
        ("fie", {"fields/"}),
        ("fields/", {"fields/north.xml"}),
        ("./s", {"./survey.xml", "./survey.py"}),
        ("nowhere/", set[str]()),
    ],
)
def test_mission_files_are_offered(
    word: str, expected: set[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "fields").mkdir()
    for name in ("survey.xml", "survey.py", "survey.md", "fields/north.xml", "fields/.hidden.xml"):
        (tmp_path / name).touch()
    monkeypatch.chdir(tmp_path)
    assert offered(f"skillwing mission run {word}") == expected


def test_missions_and_their_files_are_offered_together(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "mapping_of_mine.py").touch()
    monkeypatch.chdir(tmp_path)
    assert offered("skillwing mission run mapp") == {"mapping", "mapping_of_mine.py"}
    assert offered("skillwing campaign mapp") == {"mapping"}, "a campaign flies installed missions only"


def test_zsh_gets_the_same() -> None:
    (answer,) = [word for word in offered("skillwing start tak", "zsh") if "takeoff" in word]
    assert answer == ':(("takeoff"))\''
