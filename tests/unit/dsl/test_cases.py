"""Each file under `cases/` says in its first line which diagnostics it gets, in file order."""

from __future__ import annotations

from pathlib import Path

import pytest

from skillwing.dsl.checking.analysis import report_on
from skillwing.dsl.checking.checker import check
from skillwing.dsl.checking.reachability.approximation import Approximation
from skillwing.dsl.checking.reachability.statespace import StateSpace
from skillwing.dsl.diagnostics.diagnostic import has_errors
from skillwing.dsl.diagnostics.report import DiagnosticReport

CASES = Path(__file__).parent / "cases"
FILES = sorted(CASES.glob("*/*.skillset"))


@pytest.mark.parametrize("path", FILES, ids=lambda path: f"{path.parent.name}/{path.stem}")
def test_file_gets_exactly_the_expected_diagnostics(path: Path) -> None:
    text = path.read_text()
    expected = text.split("\n", 1)[0].removeprefix("// expect:").split()
    checked = check(text, path.name)
    assert [diagnostic.code for diagnostic in checked.diagnostics] == expected
    assert (checked.skillset is not None) == (path.parent.name == "valid")


@pytest.mark.parametrize("path", sorted(CASES.glob("valid/*.skillset")), ids=lambda path: path.stem)
def test_a_valid_file_gets_no_error_as_part_of_a_large_one_either(path: Path) -> None:
    """A skillset of this size is played through; in a large one its resources are followed one by one."""
    skillset = check(path.read_text(), path.name).skillset
    assert skillset is not None
    space, report = StateSpace(skillset), DiagnosticReport()
    report_on(Approximation(space), space, report)
    assert not has_errors(report.diagnostics), report.diagnostics
