"""Tests that start processes share two workers, and the lists of them name files that are there."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from scheduling import BUSY, WAITING, scope_of
from scheduling import starts_processes as is_listed

TESTS = Path(__file__).parents[1]
LISTED = (*BUSY, *WAITING)
FOLDERS = ("chaos", "fuzz", "history", "integration")
"""Folders whose tests may start whole systems."""
STARTS = re.compile(r"\b(Launcher|SkillsetProcesses|Popen)\b|\"--detach\"")
IMPORTED = re.compile(r"^(?:from|import) (\w+)", re.MULTILINE)


def starts_processes(file: Path, seen: set[Path]) -> bool:
    """True if the file starts processes itself or through a module of its folder."""
    if file in seen or not file.exists():
        return False
    seen.add(file)
    text = file.read_text()
    return bool(STARTS.search(text)) or any(
        starts_processes(file.with_name(f"{name}.py"), seen) for name in IMPORTED.findall(text)
    )


def test_every_file_that_starts_processes_is_in_the_list() -> None:
    files = [file for folder in FOLDERS for file in (TESTS / folder).glob("test_*.py")]
    starting = {str(file.relative_to(TESTS)) for file in files if starts_processes(file, set())}
    assert starting, "the words to look for are not those of today"
    missing = starting.difference(LISTED)
    assert not missing, f"Add {sorted(missing)} to tests/scheduling.py."


def test_every_file_of_the_list_is_there_once() -> None:
    missing = [file for file in LISTED if not (TESTS / file).is_file()]
    assert not missing, f"Remove {missing} from tests/scheduling.py."
    assert len(LISTED) == len(set(LISTED)), "A file is in tests/scheduling.py twice."


@pytest.mark.parametrize(("files", "name"), [(BUSY, "busy"), (WAITING, "waiting")])
def test_they_stay_together(files: tuple[str, ...], name: str) -> None:
    assert {scope_of(f"tests/{file}::test_that[1]") for file in files} == {name}
    assert is_listed(f"tests/{files[0]}::test_this")


def test_every_other_file_is_by_itself() -> None:
    assert scope_of("tests/unit/test_scheduling.py::test_this") == "unit/test_scheduling.py"
    assert not is_listed("tests/unit/test_scheduling.py::test_this")


def test_conformance_cases_share_a_worker() -> None:
    files = [
        "tests/conformance/test_conformance_ends.py::test_this",
        "tests/conformance/test_conformance_goals.py::test_that",
    ]
    assert {scope_of(file) for file in files} == {"conformance"}
    assert all(map(is_listed, files))
