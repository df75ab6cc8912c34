"""The language page is held to what it says."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from skillwing.dsl.checking.checker import check
from skillwing.dsl.checking.reachability.parts import MOST_SITUATIONS, MOST_SKILLS, MOST_STATES
from skillwing.dsl.checking.reachability.relations import MOST_COMBINATIONS

PAGE = (Path(__file__).parents[3] / "docs" / "language.md").read_text()
EXAMPLES = re.findall(r"^```skillset\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize("source", EXAMPLES, ids=lambda source: source.split()[1])
def test_every_example_is_valid(source: str) -> None:
    diagnostics = check(source, "language.md").diagnostics
    assert [diagnostic.message for diagnostic in diagnostics if diagnostic.severity == "error"] == []
    assert {diagnostic.code for diagnostic in diagnostics} <= {"SW082", "SW083"}  # examples need not use everything


def test_the_page_has_its_examples() -> None:
    assert len(EXAMPLES) == 4


def test_the_limits_of_the_analysis_are_as_documented() -> None:
    told = f"up to {MOST_SKILLS} skills that change something and {MOST_STATES} combinations of states in each part"
    assert told in PAGE
    assert f"{MOST_SITUATIONS} situations in the file" in PAGE
    assert f"up to {MOST_COMBINATIONS} combinations" in PAGE
