"""Problems of a mission are reported as sentences with their place, apart from files that cannot be checked."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.metadata import EntryPoint
from pathlib import Path
from types import SimpleNamespace
from typing import NoReturn

import pytest
from typer.testing import CliRunner, Result

from skillwing.bt_missions import library
from skillwing.bt_missions.cli import mission as commands
from skillwing.bt_missions.cli import mission_robots
from skillwing.bt_missions.cli.draft import write_draft
from skillwing.bt_missions.cli.robot_choice import choose_robot
from skillwing.bt_missions.mission.problems import FaultyMissionError
from skillwing.bt_missions.xml import builder
from skillwing.dsl import load
from skillwing.dsl.model import UnknownNameError
from skillwing.services.errors import InvalidOptionError, NoSystemError
from skillwing.services.terminal import connection
from skillwing.services.terminal.exit_codes import FAILED, OK, USAGE, exit_code_of

ROOT = next(folder for folder in Path(__file__).parents if (folder / "pyproject.toml").exists())
M600 = load(ROOT / "services/skillwing/m600/m600.skillset")


def check(name: Path | str, *words: str) -> Result:
    return CliRunner().invoke(commands.mission, ["check", str(name), *words])


def file_of(folder: Path, suffix: str, content: bytes | str) -> Path:
    file = folder / f"mission{suffix}"
    file.write_bytes(content if isinstance(content, bytes) else content.encode())
    return file


def template(folder: Path, suffix: str, old: str = "", new: str = "") -> Path:
    """The mission to begin with, changed."""
    file = folder / f"patrol{suffix}"
    write_draft(file, choose_robot("m600"))
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new, 1))
    return file


@pytest.mark.parametrize(
    ("module", "content", "told"),
    [
        ("patrol_nowhere", None, "there is no module `patrol_nowhere`. Correct its name, or install the package"),
        ("patrol_that_errs", "MISSION = 1 / 0", "`{}:1` raises ZeroDivisionError: division by zero. Fix it."),
        ("patrol_that_ends", "raise SystemExit(3)", "`{}:1` ends Python. Take that out."),
        ("patrol_that_lacks", "import patrols", "`{}:1` imports `patrols`, and there is no such module. Install it,"),
    ],
)
def test_an_installed_mission_that_cannot_be_loaded(
    module: str, content: str | None, told: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / f"{module}.py"
    if content is not None:
        file.write_text(content)
    monkeypatch.syspath_prepend(str(tmp_path))
    entry = EntryPoint("patrol", f"{module}:MISSION", library.ENTRY_POINTS)
    monkeypatch.setattr(library, "installed_missions", lambda: {"patrol": entry})
    with pytest.raises(InvalidOptionError) as caught:
        library.find_mission("patrol")
    assert str(caught.value).startswith(f"`patrol` is installed as `{module}:MISSION`, but ")
    assert told.format(file) in str(caught.value)


@pytest.mark.parametrize(
    ("suffix", "content", "place", "told"),
    [
        (".xml", "", ":1:1", "There is no tag in this file"),
        (".xml", "<root>\n<a>\n</root>", ":3:3", "`<a>` of line 2 is not closed before this. Write `</a>`."),
        (".xml", "<root>\n<a>\n", ":3:1", "`<a>` of line 2 is not closed before this."),
        (".xml", "<root>\n<a b=1/></root>", ":2:6", "This is no XML from here on."),
        (".xml", '<root a="1"\n a="2"/>', ":2:2", "This tag has an attribute twice."),
        (".xml", "<root>&auml;</root>", ":1:7", "What this `&` begins is not known."),
        (".xml", "<root/><root/>", ":1:8", "The root tag was closed before this."),
        (".xml", '<?xml version="1.0" encoding="klingon"?><root/>', ":1", "The encoding that is declared here"),
        (".xml", "<tree/>", ":1", "Begin with `<root"),
        (".py", "x = (\n1", ":1:5", "This is not valid Python: "),
        (".py", b"x = 1\0", "", "This is not valid Python: "),
        (".py", "# coding: klingon\n", "", "This is not valid Python: unknown encoding: klingon"),
        (".py", "\nimport nothing_like_it", ":2", "It imports `nothing_like_it`, and there is no such module."),
        (".py", "from math import tao", ":1", "It imports from `math` what that does not have"),
        (".py", "def f():\n    return 1 / 0\n\nf()", ":2", "It raises ZeroDivisionError while it is loaded"),
        (".py", "raise SystemExit(3)", ":1", "It ends Python while it is loaded."),
        (".py", "MISSION = 3", "", "It defines no mission."),
    ],
)
def test_what_is_wrong_in_a_file_is_a_problem_with_its_place(
    tmp_path: Path, suffix: str, content: bytes | str, place: str, told: str
) -> None:
    file = file_of(tmp_path, suffix, content)
    result = check(file, "--json")
    assert result.exit_code == FAILED, result.output
    (found,) = json.loads(result.stdout)
    assert found["place"] == f"{file}{place}"
    assert found["text"].startswith(told)


@pytest.mark.parametrize("suffix", [".xml", ".py"])
def test_both_kinds_of_files_get_the_same_messages(tmp_path: Path, suffix: str) -> None:
    file = template(tmp_path, suffix)
    assert check(file).exit_code == OK
    file.write_text(file.read_text().replace("zed_status", "zed_staus"))
    result = check(file)
    assert result.exit_code == FAILED
    assert "There is no resource `zed_staus`; did you mean `zed_status`?" in result.output
    assert "patrol: 1 problem with m600\n" in result.output


def test_a_tree_that_cannot_be_built_is_reported_with_its_line(tmp_path: Path) -> None:
    file = template(tmp_path, ".py", "        takeoff = ", "        1 / 0\n        takeoff = ")
    line = file.read_text()[: file.read_text().index("1 / 0")].count("\n") + 1
    result = check(file)
    assert result.exit_code == FAILED
    assert f"{file}:{line}: It raises ZeroDivisionError while it is built: division by zero. Fix it.\n" in result.output


@pytest.mark.parametrize(
    ("old", "new", "is_placed", "told"),
    [
        (
            "        takeoff = ",
            "        raise SystemExit(4)\n        takeoff = ",
            True,
            "It ends Python while it is built.",
        ),
        (
            "        return MissionTrees(",
            "        MissionTrees(",
            False,
            "It raises TypeError while it is built: `build` returns NoneType instead of MissionTrees. Fix it.",
        ),
        (
            "return MissionTrees(root,",
            "return MissionTrees(7,",
            False,
            "It raises AttributeError while it is checked: ",
        ),
    ],
)
def test_whatever_a_mission_does_while_it_is_built_and_checked_is_a_problem_of_its_file(
    tmp_path: Path, old: str, new: str, is_placed: bool, told: str
) -> None:
    file = template(tmp_path, ".py", old, new)
    line = file.read_text()[: file.read_text().index(new)].count("\n") + 1
    result = check(file, "--json")
    assert result.exit_code == FAILED, result.output
    (found,) = json.loads(result.stdout)
    assert found["place"] == (f"{file}:{line}" if is_placed else str(file))
    assert found["text"].startswith(told)


def test_an_inner_failure_is_reported_with_its_tree_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def node_types(skillset: object) -> NoReturn:
        raise KeyError("from within")

    monkeypatch.setattr(builder, "node_types", node_types)
    file = template(tmp_path, ".xml")
    result = check(file, "--json")
    assert result.exit_code == FAILED, result.output
    (found,) = json.loads(result.stdout)
    assert found == {"place": str(file), "text": "It raises KeyError while it is built: 'from within'. Fix it."}


@pytest.mark.parametrize("suffix", [".xml", ".py"])
@pytest.mark.parametrize("what", ["missing", "a folder", "no text"])
def test_what_cannot_be_looked_at_is_a_wrong_use(tmp_path: Path, suffix: str, what: str) -> None:
    file = tmp_path / f"mission{suffix}"
    if what == "a folder":
        file.mkdir()
    elif what == "no text":
        file.write_bytes(b"<root>\xff\xfe</root>")
    error = check(file).exception
    assert isinstance(error, InvalidOptionError)
    assert not isinstance(error, FaultyMissionError)
    assert exit_code_of(error) == USAGE
    assert str(file) in str(error)
    assert {"missing": "There is no file", "a folder": "is a directory", "no text": "is not a text file in UTF-8"}[
        what
    ] in str(error)


@pytest.mark.parametrize("words", [["mapin"], ["mapping", "sped=1"], ["mapping", "speed=fast"]])
def test_what_nobody_knows_is_a_wrong_use(words: list[str]) -> None:
    error = check(*words).exception
    assert isinstance(error, UnknownNameError | InvalidOptionError)
    assert exit_code_of(error) == USAGE


def test_problems_of_the_file_are_reported_without_a_system(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def find_target(robot: str | None) -> NoReturn:
        raise NoSystemError("No system is running.")

    monkeypatch.setattr(connection, "find_target", find_target)
    file = template(tmp_path, ".xml")
    assert isinstance(CliRunner().invoke(commands.mission, ["run", str(file)]).exception, NoSystemError)
    faulty = tmp_path / "faulty"
    faulty.mkdir()
    file = template(faulty, ".xml", '<BehaviorTree ID="rescue">', '<BehaviorTree ID="there and back">')
    error = CliRunner().invoke(commands.mission, ["run", str(file)]).exception
    assert isinstance(error, FaultyMissionError)
    assert exit_code_of(error) == USAGE
    assert "There are two trees `there and back`" in str(error)


@pytest.mark.parametrize(("suffix", "skill"), [(".xml", "<return_home"), (".py", '"return_home", height')])
def test_a_mission_that_does_not_fit_is_not_begun(
    tmp_path: Path, suffix: str, skill: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The system here has no bus: nobody could be told of a mission, and no run would hold anything of it."""

    @contextmanager
    def connect(robot: str | None, *, beside: object = None) -> Iterator[SimpleNamespace]:
        yield SimpleNamespace(skillset=M600, target=SimpleNamespace(rescue_goal=None, shared=False), alive=tuple)

    monkeypatch.setattr(mission_robots, "connect", connect)
    monkeypatch.setattr(commands, "mission_context", lambda target, mission: {})
    file = template(tmp_path, suffix, skill, skill.replace("home", "hme"))
    result = CliRunner().invoke(commands.mission, ["run", str(file)])
    error = result.exception
    assert isinstance(error, FaultyMissionError)
    assert exit_code_of(error) == USAGE
    assert result.output == ""
    assert [problem.text for problem in error.problems] == [str(each).partition(": ")[2] for each in error.problems]
    assert "did you mean `return_home`?" in str(error)
    heading, problem = str(error).splitlines()
    assert heading.endswith(f"does not fit `{M600.name}`, which is what runs here:")
    assert problem == str(error.problems[0])
