"""Whatever is typed, the answer is a list of diagnostics: broken variants of good files never raise.

A mutant is told by its number alone. `SKILLWING_MUTANTS=10000` tries so many instead of the usual number, and
`make mutants` does.
"""

from __future__ import annotations

import os
import random
from bisect import bisect
from functools import cache
from itertools import accumulate
from pathlib import Path

import pytest

from skillwing.dsl.checking.checker import check
from skillwing.dsl.diagnostics.diagnostic import Diagnostic, has_errors, render_all
from skillwing.dsl.reading.lexer import lex

HERE = Path(__file__).parent
ROOT = HERE.parents[2]
FILES = sorted(
    [
        *HERE.glob("cases/valid/*.skillset"),
        *HERE.glob("cases/rl/valid/*.rl"),
        *ROOT.glob("examples/*/*.skillset"),
        *ROOT.glob("examples/*/*.rl"),
        ROOT / "services" / "skillwing" / "m600" / "m600.skillset",
    ]
)
MUTANTS = int(os.environ.get("SKILLWING_MUTANTS", "1500"))
PORTIONS = 10
CHARACTERS = "{}()[]:=.,;*/\\\"<>!&|#'-+ \n\t\0é9aZ_%"


@cache
def pieces(path: Path) -> tuple[str, ...]:
    """The lexemes of a file with the white space between them."""
    text = path.read_text(encoding="utf-8")
    cuts = [place for lexeme in lex(text, path.name) for place in (lexeme.start, lexeme.end)]
    return tuple(text[start:end] for start, end in zip([0, *cuts], [*cuts, len(text)], strict=True) if start < end)


@cache
def shares() -> list[float]:
    """How often each file is taken, added up: the larger, the more seldom, since it takes the longer."""
    return list(accumulate(1 / (4000 + sum(map(len, pieces(path)))) for path in FILES))


def mutant(number: int) -> tuple[str, str]:
    """The text and file name of a mutant."""
    chance = random.Random(number)
    path = FILES[bisect(shares(), chance.random() * shares()[-1])]
    changed = list(pieces(path))
    for _ in range(chance.choice((1, 1, 1, 2, 3))):
        if not changed:
            break
        if chance.random() < 0.7:
            _change_words(changed, chance)
        else:
            _change_characters(changed, chance)
    return "".join(changed), path.name


def _change_words(words: list[str], chance: random.Random) -> None:
    at, other = chance.randrange(len(words)), chance.randrange(len(words))
    match chance.randrange(5):
        case 0:
            del words[at]
        case 1:
            words.insert(at, words[at])
        case 2:
            words[at], words[other] = words[other], words[at]
        case 3:
            words[at] = words[other]
        case _:
            del words[max(at, 1) : max(at, 1) + chance.choice((3, 10, 1000))]


def _change_characters(words: list[str], chance: random.Random) -> None:
    at = chance.randrange(len(words))
    word = words[at]
    place = chance.randrange(len(word) + 1)
    match chance.randrange(4):
        case 0:
            word = word[:place] + word[place + 1 :]
        case 1:
            word = word[:place] + word[max(0, place - 1) :]
        case 2:
            word = word[:place] + chance.choice(CHARACTERS) + word[place:]
        case _:
            word = word[:place] + word[place:][1::-1] + word[place + 2 :]
    words[at] = word or " "


def is_inside(diagnostic: Diagnostic, lines: list[str], file: str) -> bool:
    """Tell whether a diagnostic points at characters of the text, or right behind the end of a line."""
    span = diagnostic.span
    begins = 1 <= span.line <= len(lines) and 1 <= span.column <= len(lines[span.line - 1]) + 1
    ends = span.line <= span.end_line <= len(lines) and span.end_column <= len(lines[span.end_line - 1]) + 2
    return span.file == file and begins and ends and (span.line, span.column) < (span.end_line, span.end_column)


@pytest.mark.parametrize("portion", range(PORTIONS))
def test_mutants_get_diagnostics_and_never_a_traceback(portion: int) -> None:
    for number in range(portion, MUTANTS, PORTIONS):
        text, file = mutant(number)
        try:
            checked = check(text, file)
            rendered = render_all(checked.diagnostics, text)
        except Exception as error:
            error.add_note(f"mutant {number} of {file}")
            raise
        lines = text.split("\n")
        assert (checked.skillset is None) == has_errors(checked.diagnostics), number
        assert all(is_inside(diagnostic, lines, file) for diagnostic in checked.diagnostics), number
        assert all(diagnostic.message in rendered for diagnostic in checked.diagnostics), number


def test_most_mutants_are_invalid_and_some_are_not() -> None:
    verdicts = [check(*mutant(number)).skillset is None for number in range(200)]
    assert 100 < sum(verdicts) < 200


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
