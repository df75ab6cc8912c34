"""Robots by name, by folder and by module."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from lift_robot import forget, make_package

from skillwing.dsl.model import UnknownNameError
from skillwing.dsl.packages import import_name
from skillwing.services.errors import InvalidOptionError
from skillwing.services.robot import find_robot

PACKAGE = "lift_in_a_folder"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A generated package that nothing has imported; what importing it changes is undone."""
    monkeypatch.setattr(sys, "path", list(sys.path))
    monkeypatch.setenv("PYTHONPATH", "")
    make_package(tmp_path / PACKAGE)
    monkeypatch.chdir(tmp_path)
    forget(PACKAGE)
    return tmp_path / PACKAGE


def test_a_generated_folder_is_a_robot(folder: Path) -> None:
    robot = find_robot(str(folder))
    assert (robot.name, robot.clock) == ("lift", "wall")
    assert robot.load_skillset().name == "lift"
    assert dict(robot.hooks) == {
        "go": f"{PACKAGE}.skills.go:GoManager",
        "shine": f"{PACKAGE}.skills.shine:ShineManager",
    }
    assert [spec.name for spec in robot.managers()] == ["data_manager", "resource_manager", "skill/go", "skill/shine"]
    assert find_robot(PACKAGE) is robot
    assert find_robot(f"{PACKAGE}.robot:ROBOT") is robot


def test_processes_that_are_started_from_here_find_it_too(folder: Path, tmp_path: Path) -> None:
    find_robot(str(folder))
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    command = [sys.executable, "-c", f"import {PACKAGE}.skills.go"]
    assert subprocess.run(command, cwd=elsewhere, env=dict(os.environ), check=False).returncode == 0


def test_a_package_in_the_current_folder_is_found_here_and_in_processes(folder: Path) -> None:
    assert find_robot(f"{PACKAGE}.robot:ROBOT").name == "lift"
    command = [sys.executable, "-c", f"import {PACKAGE}.skills.go"]
    assert subprocess.run(command, cwd=folder, env=dict(os.environ), check=False).returncode == 0


def test_a_part_of_a_namespace_package_keeps_its_name() -> None:
    import skillwing.m600 as package  # noqa: PLC0415

    assert import_name(Path(package.__path__[0]))[0] == "skillwing.m600"


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ("ROBOT = 5", "is no `Robot`"),
        ("ROBOT = ROBOTS", r"robot\.py:1` raises NameError"),
        ("def", r"robot\.py:1` is no Python"),
        ("import nowhere", r"robot\.py:1` imports `nowhere`, and there is no such module"),
        ("raise SystemExit", r"robot\.py:1` ends Python"),
        ("", "has no `ROBOT`"),
    ],
)
def test_a_table_that_cannot_be_used_is_said_in_a_sentence(folder: Path, change: str, sentence: str) -> None:
    (folder / "robot.py").write_text(change)
    with pytest.raises(InvalidOptionError, match=sentence):
        find_robot(str(folder))


def test_a_folder_without_a_table_says_how_to_make_one(tmp_path: Path) -> None:
    with pytest.raises(InvalidOptionError, match="skillwing generate FILE"):
        find_robot(str(tmp_path))


def test_a_folder_that_cannot_be_imported_says_so(folder: Path) -> None:
    renamed = folder.rename(folder.with_name("my-lift"))
    with pytest.raises(InvalidOptionError, match="my_lift"):
        find_robot(str(renamed))


def test_what_is_no_robot_at_all() -> None:
    told = r"did you mean `m600`\?.* The folder of a robot package is possible, too: `./m60`\."
    with pytest.raises(UnknownNameError, match=told):
        find_robot("m60")
    with pytest.raises(InvalidOptionError, match="no folder"):
        find_robot("robots/nowhere")
