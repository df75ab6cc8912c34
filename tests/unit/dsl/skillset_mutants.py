"""Broken variants of good skillset files, and what has to hold of the answer to each. A mutant is told by its number.

python tests/unit/dsl/skillset_mutants.py [--mutants 10000] [--write docs/reliability.md]
"""

from __future__ import annotations

import platform
import random
from argparse import ArgumentParser
from bisect import bisect
from collections import Counter
from datetime import date
from functools import cache
from itertools import accumulate
from multiprocessing import Pool
from pathlib import Path

from skillwing.dsl.checking.checker import check
from skillwing.dsl.diagnostics.diagnostic import Diagnostic, has_errors, render_all
from skillwing.dsl.reading.dialect import lex
from skillwing.services.terminal.doc_sections import Marks, page_with

MARKS = Marks.named("mutants of skillset files")
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
CHARACTERS = "{}()[]:=.,;*/\\\"<>!&|#'-+ \n\t\0é9aZ_%"


@cache
def pieces(path: Path) -> tuple[str, ...]:
    """The lexemes of a file with the white space between them."""
    text = path.read_text(encoding="utf-8")
    cuts = [place for lexeme in lex(text, path.name) for place in (lexeme.start, lexeme.end)]
    return tuple(text[start:end] for start, end in zip([0, *cuts], [*cuts, len(text)], strict=True) if start < end)


@cache
def shares() -> list[float]:
    """Cumulative weights of the files. Larger files take longer and are chosen less often."""
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


def judge(number: int) -> bool:
    """Tell whether a mutant is valid. Raises AssertionError for a wrong answer, and whatever the checker raises."""
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
    return checked.skillset is not None


def _verdict(number: int) -> str:
    try:
        return "valid" if judge(number) else "refused"
    except AssertionError:
        return "wrong"
    except Exception:  # noqa: BLE001 - whatever it raises is what is looked for
        return "raised"


def main() -> int:
    """Judge many mutants, tell what came out, and fail if any answer was wrong."""
    parser = ArgumentParser(description=__doc__.partition("\n")[0] if __doc__ else None)
    parser.add_argument("--mutants", type=int, default=10_000)
    parser.add_argument("--write", type=page_with(MARKS), metavar="PAGE", help="put the figures into this page")
    options = parser.parse_args()
    with Pool() as pool:
        verdicts = Counter(pool.imap_unordered(_verdict, range(options.mutants), chunksize=100))
    told = (
        f"{options.mutants:,} mutants of {len(FILES)} files: {verdicts['refused']:,} refused with diagnostics that "
        f"point into the file, {verdicts['valid']:,} still valid, {verdicts['wrong'] or 'none'} with a wrong answer, "
        f"{verdicts['raised'] or 'none'} raised. {platform.machine()}, Python {platform.python_version()}, "
        f"{date.today().isoformat()}."  # noqa: DTZ011
    )
    print(told)  # noqa: T201
    if options.write is not None:
        MARKS.replace(options.write, told)
    return 1 if verdicts["wrong"] or verdicts["raised"] else 0


if __name__ == "__main__":
    raise SystemExit(main())
