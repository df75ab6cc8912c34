"""The comment that belongs to a declaration: on the lines right above it, or behind it on its last line."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from textwrap import dedent

from skillwing.dsl.reading.lexemes import COMMENT, Lexeme


def comment_on(lexemes: Sequence[Lexeme], start: int, end: int, text: str) -> str:
    """The comment on what stands between two offsets, without comment signs; empty if there is none.

    lexemes: those of the whole text, comments included. A comment that stands alone on its lines is on what follows
    it; an empty line between the two parts them.
    """
    first = bisect_left(lexemes, start, key=lambda lexeme: lexeme.start)
    above: list[str] = []
    below = start
    for lexeme in reversed(lexemes[:first]):
        gap = text[lexeme.end : below]
        if lexeme.kind != COMMENT or gap.count("\n") != 1 or not _stands_alone(lexeme, text):
            break
        above.insert(0, bare(lexeme))
        below = lexeme.start
    if above:
        return "\n".join(above).strip()
    behind = lexemes[bisect_left(lexemes, end, key=lambda lexeme: lexeme.start) :][:1]
    on_its_line = [lexeme for lexeme in behind if lexeme.kind == COMMENT and "\n" not in text[end : lexeme.start]]
    return bare(on_its_line[0]) if on_its_line else ""


def bare(comment: Lexeme) -> str:
    """What a comment says: without its signs, and without the dashes that a heading is drawn with."""
    if comment.text.startswith("//"):
        return comment.text[2:].strip().strip("-").strip()
    return dedent(comment.text[2:-2].strip("*")).strip()


def _stands_alone(comment: Lexeme, text: str) -> bool:
    return not text[text.rfind("\n", 0, comment.start) + 1 : comment.start].strip()
