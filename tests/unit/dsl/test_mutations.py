"""Whatever is typed, the answer is a list of diagnostics: broken variants of a good file never raise."""

from __future__ import annotations

import random
import re
from pathlib import Path

import pytest

from skillwing.dsl.checking.checker import check
from skillwing.dsl.diagnostics.diagnostic import has_errors, render_all

SOURCE = (Path(__file__).parent / "cases" / "valid" / "paper.skillset").read_text()
RICH = (Path(__file__).parent / "cases" / "valid" / "everything.skillset").read_text()
PIECES = re.compile(r"\s+|\w+|==|->|=>|\.\.|.", re.DOTALL)
NOISE = [
    "{",
    "}",
    "(",
    ")",
    ":",
    "->",
    "=",
    "==",
    "skill",
    "resource",
    "effect",
    "[",
    '"',
    "/*",
    "é",
    "\0",
    "9",
    "..",
    "*",
]


def mutated(source: str, chance: random.Random) -> str:
    pieces = PIECES.findall(source)
    for _ in range(chance.randint(1, 4)):
        at = chance.randrange(len(pieces))
        match chance.randrange(5):
            case 0:
                del pieces[at]
            case 1:
                pieces.insert(at, chance.choice(NOISE))
            case 2:
                pieces[at] = chance.choice(pieces)
            case 3:
                other = chance.randrange(len(pieces))
                pieces[at], pieces[other] = pieces[other], pieces[at]
            case _:
                pieces = pieces[: at + 1]
    return "".join(pieces)


@pytest.mark.parametrize(("source", "seed", "count"), [(SOURCE, 1, 300), (RICH, 2, 200)], ids=["paper", "everything"])
def test_mutants_get_diagnostics_and_never_a_traceback(source: str, seed: int, count: int) -> None:
    chance = random.Random(seed)
    for _ in range(count):
        text = mutated(source, chance)
        checked = check(text, "mutant")
        assert (checked.skillset is None) == has_errors(checked.diagnostics), text
        lines = text.split("\n")
        for diagnostic in checked.diagnostics:
            assert 1 <= diagnostic.span.line <= len(lines), text
            assert diagnostic.message
        assert render_all(checked.diagnostics, text)


def test_repeated_noise_is_survived() -> None:
    for noise in NOISE:
        checked = check(f"skillset s {{ skill k {{ {f'{noise} ' * 50}", "noise")
        assert checked.skillset is None
        assert checked.diagnostics


def test_absurd_sizes_are_survived() -> None:
    deep = "not " * 5000
    wide = " and ".join(["a"] * 5000)
    chain = " ".join(f"type T{n} {{ x: T{n + 1} }}" for n in range(500))
    for source, code in (
        (
            f"skillset s {{ data {{ a: bool }} skill k {{ precondition {{ p: data=({deep}a) }} result {{ D }} }} }}",
            "SW029",
        ),
        (
            f"skillset s {{ data {{ a: bool }} skill k {{ precondition {{ p: data=({wide}) }} result {{ D }} }} }}",
            "SW029",
        ),
        (f"skillset s {{ {chain} type T500 {{ x: bool }} }}", "SW029"),
        (f"skillset s {{ data {{ a: float64 period={'9' * 5000} }} }}", "SW004"),
        ("skillset s { data { a: float64 period=1e999 } }", "SW004"),
        (f"skillset s {{ data {{ a: float64[{'9' * 5000}] }} }}", "SW004"),
        ("skillset s { " + "{ " * 5000, "SW002"),
    ):
        assert code in [diagnostic.code for diagnostic in check(source, "absurd").diagnostics]
