"""Broken variants of good files never raise: the result is always a list of diagnostics.

`make mutants` tries many more.
"""

from __future__ import annotations

from functools import cache

import skillset_mutants
from skillset_mutants import FILES

from skillwing.dsl.checking.checker import check

MUTANTS = 200
judge = cache(skillset_mutants.judge)


def test_mutants_get_diagnostics_and_never_a_traceback() -> None:
    for number in range(MUTANTS):
        judge(number)


def test_most_mutants_are_invalid_and_some_are_not() -> None:
    verdicts = [not judge(number) for number in range(MUTANTS)]
    assert MUTANTS / 2 < sum(verdicts) < MUTANTS


def test_files_of_all_kinds_are_mutated() -> None:
    assert all(check(path.read_text(encoding="utf-8"), path.name).skillset for path in FILES)
    assert {path.suffix for path in FILES} == {".skillset", ".rl"}


def test_deep_nesting_is_survived() -> None:
    deep = "not " * 5000
    wide = " and ".join(["a"] * 5000)
    chain = " ".join(f"type T{n} {{ x: T{n + 1} }}" for n in range(500))
    predicate = "skillset s {{ data {{ a: bool }} skill k {{ precondition {{ p: data=({}) }} result {{ D }} }} }}"
    for source, code in (
        (predicate.format(f"{deep}a"), "SW029"),
        (predicate.format(wide), "SW029"),
        (f"skillset s {{ {chain} type T500 {{ x: bool }} }}", "SW029"),
        (f"skillset s {{ data {{ a: float64 period={'9' * 5000} }} }}", "SW004"),
        ("skillset s { data { a: float64 period=1e999 } }", "SW004"),
        (f"skillset s {{ data {{ a: float64[{'9' * 5000}] }} }}", "SW004"),
    ):
        assert code in [diagnostic.code for diagnostic in check(source, "absurd").diagnostics]
