"""Every test that docs/semantics.md names exists, and the page has every ending of the conformance suite."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "semantics.md").read_text(encoding="utf-8")
DEFINED = re.compile(r"^\s*(?:async )?def (test_\w+)", re.MULTILINE)
NAMED = re.compile(r"`(test_\w+(?:\.py)?)`")


def proofs_in(folder: Path) -> set[str]:
    """Names of the test functions and test files below a folder."""
    files = list(folder.rglob("test_*.py"))
    names = {name for path in files for name in DEFINED.findall(path.read_text(encoding="utf-8"))}
    return names | {path.name for path in files}


def test_every_test_that_the_page_names_exists() -> None:
    named = set(NAMED.findall(PAGE))
    assert len(named) > 50
    missing = named - proofs_in(ROOT / "tests")
    assert not missing, f"docs/semantics.md names tests that do not exist: {sorted(missing)}. Correct the page."


def test_every_end_and_every_rule_has_its_conformance_case() -> None:
    cases = proofs_in(ROOT / "tests" / "conformance")
    rows = [line for line in PAGE.splitlines() if re.match(r"\| (\d+ |`[A-Z]+(_x)?` \|)", line)]
    assert len(rows) == 11 + 9, "11 rules and 9 endings; change this number with the page"
    bare = [row for row in rows if not cases & set(NAMED.findall(row))]
    assert not bare, f"These rows of docs/semantics.md name no test of tests/conformance: {bare}. Write one."
    ends = {case for case in cases if re.match(r"test_(nv|nr|ri|s|n|it|busy|error|lost)_", case)}
    unnamed = ends - set(NAMED.findall(PAGE))
    assert not unnamed, f"Name these cases in the table of endings of docs/semantics.md: {sorted(unnamed)}."
