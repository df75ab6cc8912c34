"""Spaces between the words of a statement."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

from skillwing.dsl.reading.lexemes import Lexeme

_NONE_BEFORE = frozenset({"COLON", "COMMA", "CLOSE_PAREN", "ARRAY", "UP_TO", "DOT"})
_NONE_BEHIND = frozenset({"OPEN_PAREN", "UP_TO", "DOT"})
# What the default of a field stands behind. Every other `=` belongs to a word of the language: `period=0.1`.
_TYPED = frozenset({"NAME", "ARRAY", "UNIT", "NUMBER"})
_OPTIONS = frozenset({"IN", "PERIOD", "VIOLATION", "POST", "MODIFIABLE"})
# What may stand before the name of a result.
_MARKS = frozenset({"SUCCESS", "FAILURE"})


def joined(words: Sequence[Lexeme], start: int = 0, stop: int | None = None) -> str:
    """The words of a statement from `start` up to `stop` on one line, with the spaces of the style."""
    chosen = range(len(words))[start:stop]
    return "".join((" " if index > start and _apart(words, index) else "") + words[index].text for index in chosen)


def cells(words: Sequence[Lexeme]) -> tuple[str, ...]:
    """A statement on one line, cut into `name:`, value and options; not cut if it has another shape."""
    cuts = [0, *_cuts(words), len(words)]
    return tuple(joined(words, start, stop) for start, stop in pairwise(cuts) if start < stop)


def _cuts(words: Sequence[Lexeme]) -> Iterator[int]:
    kinds = [word.kind for word in words]
    head = kinds.index("COLON") + 1 if "COLON" in kinds else 0
    if head != (3 if kinds[0] in _MARKS else 2):
        return
    yield head
    depth = 0
    for index in range(head + 1, len(words)):
        depth += {"OPEN_PAREN": 1, "CLOSE_PAREN": -1}.get(kinds[index], 0)
        if not depth and (kinds[index] in _OPTIONS or _is_default(words, index)):
            yield index
            return


def _is_default(words: Sequence[Lexeme], index: int) -> bool:
    """True if the word is the `=` before the default of a field."""
    return words[index].kind == "EQUALS" and index > 0 and words[index - 1].kind in _TYPED


def _apart(words: Sequence[Lexeme], index: int) -> bool:
    before, word = words[index - 1], words[index]
    if word.kind == "EQUALS":
        return _is_default(words, index)
    if before.kind == "EQUALS":
        return _is_default(words, index - 1)
    return word.kind not in _NONE_BEFORE and before.kind not in _NONE_BEHIND
