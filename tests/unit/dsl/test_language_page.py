"""The language page is held to what it says."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from skillwing.dsl.checking.checker import check
from skillwing.dsl.diagnostics.codes import CODES

PAGE = (Path(__file__).parents[3] / "docs" / "language.md").read_text()
EXAMPLES = re.findall(r"^```skillset\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize("source", EXAMPLES, ids=lambda source: source.split()[1])
def test_every_example_is_valid(source: str) -> None:
    diagnostics = check(source, "language.md").diagnostics
    assert [diagnostic.message for diagnostic in diagnostics if diagnostic.severity == "error"] == []
    assert {diagnostic.code for diagnostic in diagnostics} <= {"SW082", "SW083"}  # examples need not use everything


def test_every_code_is_listed() -> None:
    assert len(EXAMPLES) == 4
    rows = re.findall(r"^\| (SW\d+) \| (\w+) \| (.*?) \|", PAGE, re.MULTILINE)
    assert rows == [(code.name, code.severity, code.title) for code in CODES.values()]
