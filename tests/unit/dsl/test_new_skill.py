"""`skillwing new-skill`: the file, the package and the test that it leaves behind."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import typer
from command_runner import CommandRunner

from skillwing.dsl import load, parse
from skillwing.dsl.commands.generate import generate
from skillwing.dsl.commands.new_skill import new_skill
from skillwing.dsl.generating.new_skill import with_skill
from skillwing.dsl.printing.formatting import format_source

ROOT = Path(__file__).parents[3]
EXAMPLES = sorted((ROOT / "examples").glob("*/*.skillset"))
SOURCE = """\
// Before.
skillset lamp {
    resource light {
        initial OFF
        OFF -> ON
        ON -> OFF
    }

    skill shine {
        effect {
            on:  light -> ON
            off: light -> OFF
        }
        precondition {
            dark: resource=(light == OFF)
            success on
        }
        interrupt { apply=off }
    }
    // A remark with a } in it.
} // After, with another }.
"""


@pytest.fixture
def app() -> typer.Typer:
    application = typer.Typer()
    application.command("generate")(generate)
    application.command("new-skill")(new_skill)
    return application


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    path = Path("lamp.skillset")
    path.write_text(SOURCE, encoding="utf-8")
    return path


def run(app: typer.Typer, *words: str) -> Any:
    return CommandRunner().invoke(app, list(words))


def test_the_skill_comes_last_and_nothing_else_changes(app: typer.Typer, file: Path) -> None:
    result = run(app, "new-skill", "blink", "--skillset", str(file))
    assert result.exit_code == 0
    before, after = SOURCE.splitlines(), file.read_text().splitlines()
    added = after[len(before) - 1 : -1]
    assert after == [*before[:-1], *added, before[-1]]
    assert [skill.name for skill in load(file).skills] == ["shine", "blink"]
    assert "skillwing generate lamp.skillset -o DIR" in result.output


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_what_was_in_the_style_stays_in_it(path: Path) -> None:
    styled = format_source(path.read_text("utf-8"))
    extended = with_skill(styled, "brand_new", path.name)
    assert format_source(extended) == extended
    assert parse(extended).skill("brand_new").results


def test_it_works_right_after(app: typer.Typer, file: Path, tmp_path: Path) -> None:
    assert run(app, "generate", str(file), "-o", "lamp").exit_code == 0
    result = run(app, "new-skill", "blink", "-s", str(file), "-r", "lamp")
    assert result.exit_code == 0
    assert "[ ] `pytest lamp/tests`" in result.output
    assert "returns a `BlinkFeedback`" in result.output
    assert run(app, "generate", str(file), "-o", "lamp", "--check").exit_code == 0
    assert '"blink"' in (tmp_path / "lamp" / "generated" / "processes.py").read_text()
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "lamp/tests"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert "1 passed" in done.stdout, done.stdout


def test_the_test_goes_where_the_project_collects_those_of_other_skills(
    app: typer.Typer, file: Path, tmp_path: Path
) -> None:
    run(app, "generate", str(file), "-o", "lamp")
    (tmp_path / "pyproject.toml").write_text('[tool.pytest.ini_options]\ntestpaths = ["tests"]\npythonpath = ["."]\n')
    (tmp_path / "Makefile").write_text("lint:\n\ttrue\ngenerate: lint\n\ttrue\n")
    beside = tmp_path / "tests" / "lamps" / "test_shine.py"
    beside.parent.mkdir(parents=True)
    beside.write_text("")
    result = run(app, "new-skill", "blink", "-s", str(file), "-r", "lamp")
    assert "yours from now on: lamp/skills/blink.py, tests/lamps/test_blink.py." in result.output
    assert "[ ] `pytest tests/lamps`" in result.output
    assert "`make generate`, which" in result.output
    assert "`[skill.blink]` in lamp.mock.toml" in result.output
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert "1 passed" in done.stdout, done.stdout


def test_only_the_new_skill_gets_a_skeleton(app: typer.Typer, file: Path, tmp_path: Path) -> None:
    run(app, "generate", str(file), "-o", "lamp", "--no-skeletons")
    run(app, "new-skill", "blink", "-s", str(file), "-r", "lamp")
    assert {path.name for path in (tmp_path / "lamp" / "skills").iterdir()} == {"__init__.py", "blink.py"}


def test_a_skillset_in_its_package_needs_no_robot_to_be_named(app: typer.Typer, file: Path, tmp_path: Path) -> None:
    inside = tmp_path / "lamp" / "lamp.skillset"
    inside.parent.mkdir()
    file.rename(inside)
    run(app, "generate", str(inside), "-o", "lamp")
    assert run(app, "new-skill", "blink", "-s", str(inside)).exit_code == 0
    assert (tmp_path / "lamp" / "tests" / "test_blink.py").is_file()


def test_what_somebody_wrote_is_left_alone(app: typer.Typer, file: Path, tmp_path: Path) -> None:
    run(app, "generate", str(file), "-o", "lamp")
    mine = tmp_path / "lamp" / "skills" / "blink.py"
    mine.write_text("MINE = 1\n")
    run(app, "new-skill", "blink", "-s", str(file), "-r", "lamp")
    assert mine.read_text() == "MINE = 1\n"


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("shine", "There is a skill `shine` already"),
        ("my-skill", "letters, digits and underscores"),
        ("2x", "letters, digits and underscores"),
        ("class", "cannot be used in Python"),
        ("_hidden", "cannot be used in Python"),
        ("Shine", "`ShineInputs`"),
    ],
)
def test_names_that_cannot_be_are_refused_and_nothing_is_written(
    app: typer.Typer, file: Path, name: str, sentence: str
) -> None:
    result = run(app, "new-skill", "-s", str(file), "--", name)
    assert result.exit_code == 2
    assert sentence in result.stderr
    assert file.read_text() == SOURCE


def test_a_mistyped_robot_is_no_new_package(app: typer.Typer, file: Path, tmp_path: Path) -> None:
    run(app, "generate", str(file), "-o", "lantern")
    result = run(app, "new-skill", "blink", "-s", str(file), "-r", "lantrn")
    assert result.exit_code == 2
    assert result.stderr == "There is no robot's package `lantrn`. Did you mean `lantern`?\n"
    other = run(app, "new-skill", "blink", "-s", str(file), "-r", "robots/crane")
    assert "Make it: `skillwing generate lamp.skillset -o robots/crane`." in other.stderr
    assert file.read_text() == SOURCE
    assert sorted(path.name for path in tmp_path.iterdir()) == ["lamp.skillset", "lantern"]


def test_a_skillset_with_errors_is_shown_and_left_alone(app: typer.Typer, file: Path) -> None:
    broken = SOURCE.replace("success on", "success of")
    file.write_text(broken)
    result = run(app, "new-skill", "blink", "-s", str(file))
    assert result.exit_code == 1
    assert "nothing was added" in result.output
    assert file.read_text() == broken


def test_copies_and_the_notation_that_is_only_read_are_refused(app: typer.Typer, file: Path, tmp_path: Path) -> None:
    run(app, "generate", str(file), "-o", "lamp")
    copy = tmp_path / "lamp" / "generated" / "lamp.skillset"
    for command in (["new-skill", "blink", "-s", str(copy)], ["generate", str(copy), "-o", "lamp"]):
        refused = run(app, *command)
        assert refused.exit_code == 2
        assert "copy" in refused.stderr
    assert copy.is_file()
    other = tmp_path / "lamp.rl"
    other.write_text("skillset lamp { skill shine { } }")
    assert "skillwing convert" in run(app, "new-skill", "blink", "-s", str(other)).stderr
