"""What a run of the mutation bench writes down: survivors by name, and that it is not over when it is not."""

from __future__ import annotations

import argparse
from pathlib import Path

import pytest
from mutation_run import BEGIN, END, NO_TEST, NOT_JUDGED, SURVIVED, Verdicts, page_with_place, write_section
from rules import RULES

from skillwing.services import client, core, managers

BEGIN_GOAL = "skillwing.services.core.resource_core.xǁResourceCoreǁbegin__mutmut_"
CODES = {f"{BEGIN_GOAL}1": 1, f"{BEGIN_GOAL}2": SURVIVED, f"{BEGIN_GOAL}3": NO_TEST, f"{BEGIN_GOAL}4": NOT_JUDGED}


def test_a_page_without_marks_is_refused_before_anything_runs(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    for text in (None, "nothing", f"{END} {BEGIN}", f"{BEGIN} {BEGIN} {END}"):
        if text is not None:
            page.write_text(text, encoding="utf-8")
        with pytest.raises(argparse.ArgumentTypeError, match="no place"):
            page_with_place(str(page))


def test_what_is_known_so_far_says_so_and_names_survivors(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text(f"a\n{BEGIN}\nold\n{END}\nz\n", encoding="utf-8")
    write_section(page_with_place(str(page)), Verdicts(CODES, {f"{BEGIN_GOAL}2": ""}).section())
    text = page.read_text(encoding="utf-8")
    assert text.startswith("a\n")
    assert text.endswith("z\n")
    assert "old" not in text
    assert "2 of 4 mutants are judged, 1 survive" in text
    assert "not over: 1 more have outlived the unit tests" in text
    assert "| `resource_core.py` | 4 | 1 | 0 | 0 | 1 | 2 |" in text
    assert "- `resource_core.py`, `ResourceCore.begin`: 2\n" in text


def test_a_run_that_is_over_does_not_excuse_itself() -> None:
    second = {f"{BEGIN_GOAL}2": "tests/simulation/test_simulation.py::test_promises_are_kept[0]", f"{BEGIN_GOAL}3": ""}
    told = Verdicts({name: code for name, code in CODES.items() if code is not NOT_JUDGED}, second).section()
    assert "3 of 3 mutants are judged, 1 survive" in told
    assert "not over" not in told
    assert "| `resource_core.py` | 3 | 1 | 0 | 1 | 1 | 0 |" in told


def test_rules_name_functions_that_exist() -> None:
    """A function that was renamed would fall out of its rule without a word."""
    files = [
        file for package in (core, managers, client) for path in package.__path__ for file in Path(path).glob("*.py")
    ]
    code = "\n".join(file.read_text(encoding="utf-8") for file in files)
    for functions in RULES.values():
        for function in functions:
            name = function.rpartition(".")[2]
            assert f"def {name}(" in code, function
            assert f"class {function.rpartition('.')[0]}" in code or "." not in function, function
