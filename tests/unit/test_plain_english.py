"""Plain English in every docstring and page (CONTRIBUTING.md)."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from plain_english import markdown_problems, problems, python_problems

ROOT = Path(__file__).parents[2]
SELF = {"tests/plain_english.py", "tests/unit/test_plain_english.py"}


def tracked() -> list[Path]:
    kinds = ("*.py", "*.md", "*.skillset", "*.template", "*.yml", "*.lark", "*.toml", "*.xml", "Makefile", "Dockerfile")
    done = subprocess.run(["git", "ls-files", *kinds], cwd=ROOT, check=True, capture_output=True, text=True)
    names = [name for name in done.stdout.splitlines() if name not in SELF]
    return [ROOT / name for name in names if (ROOT / name).exists()]


def test_docstrings_and_pages_are_in_plain_english() -> None:
    found = [f"{path.relative_to(ROOT)}:{line}: {problem}" for path in tracked() for line, problem in problems(path)]
    assert not found, "Rewrite these sentences; CONTRIBUTING.md has the rules:\n" + "\n".join(found)


@pytest.mark.parametrize(
    ("source", "problem"),
    [
        ('"""How a core says no."""', "begins with `How`"),
        ('"""Of a path, the end."""', "begins with `Of`"),
        (f'"""A noun. {"word " * 26}."""', "26 words"),
        ('"""A door, mended."""', "archaic word: mended"),
        ("# Begun anew.", "archaic word: anew"),
        ("def test_begun_anew(): ...", "archaic word in a name: anew"),
        ("class Kept:\n    pass", "retired class name: Kept"),
    ],
)
def test_each_kind_of_problem_is_found(source: str, problem: str) -> None:
    ((_, found),) = python_problems(source)
    assert found.startswith(problem)


def test_code_and_short_sentences_are_no_problem() -> None:
    page = "Run `a b`: it prints.\n\n```\n" + "word " * 40 + "\n```\n\n| " + "cell. " * 30 + "|\n"
    assert list(markdown_problems(page)) == []
