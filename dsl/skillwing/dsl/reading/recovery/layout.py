"""Search for the block whose `}` is missing, by the layout of the file.

If brackets do not match, words alone seldom show which block is open: the next `}` closes it, and the file lacks one at
its end. Indentation does: a line that is indented no deeper than the line that opened a block is behind that block.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from skillwing.dsl.reading.lalr.grammar import END
from skillwing.dsl.reading.lexemes import Lexeme
from skillwing.dsl.reading.vocabulary import Vocabulary

_MOST = 20


@dataclass(frozen=True, slots=True)
class Unclosed:
    """A block without its `}`.

    opening: index of its `{` among the lexemes. closing: index of the lexeme before which the `}` is missing.
    """

    opening: int
    closing: int


def unclosed_by_layout(lexemes: Sequence[Lexeme]) -> list[Unclosed]:
    """The unclosed blocks; none if the layout does not account for exactly the missing brackets, or if too many are
    missing. In a file without indentation, blocks would end where they begin.
    """
    missing = sum({"OPEN": 1, "CLOSE": -1}.get(lexeme.kind, 0) for lexeme in lexemes)
    if not 0 < missing <= _MOST:
        return []
    found: list[Unclosed] = []
    blocks: list[tuple[int, int]] = []  # index of the bracket, indentation of its line
    line, indentation = 0, 0
    for index, lexeme in enumerate(lexemes):
        here, column = lexeme.source.position(lexeme.start)
        if here != line:
            line, indentation = here, column
            while blocks and (blocks[-1][1] > column or (blocks[-1][1] == column and lexeme.kind != "CLOSE")):
                found.append(Unclosed(blocks.pop()[0], index))
                if len(found) > missing or found[-1].opening == index - 1:
                    return []
        if lexeme.kind == "OPEN":
            blocks.append((index, indentation))
        elif lexeme.kind == "CLOSE" and blocks:
            blocks.pop()
    found += [Unclosed(opening, len(lexemes) - 1) for opening, _ in reversed(blocks)]
    return found if len(found) == missing else []


def behind_what_belongs(lexemes: Sequence[Lexeme], at: int, title: str, words: Vocabulary) -> int:
    """The index of the block's end. It is later than the layout shows if a part of the block is indented too little."""
    if not words.belongs_into(lexemes[at].kind, title):
        return at
    opened = 0
    for index, lexeme in enumerate(lexemes[at:], at):
        if opened == 0 and (lexeme.kind in {"CLOSE", END} or lexeme.kind in words.elements):
            return index
        opened += {"OPEN": 1, "CLOSE": -1}.get(lexeme.kind, 0)
    return at
