"""Source texts and their lexemes."""

from __future__ import annotations

import re
from bisect import bisect_right
from functools import cached_property

from skillwing.dsl.spans import Span

COMMENT = "COMMENT"


class Source:
    """A source text, the name of its file for diagnostics, and the lines of its characters."""

    def __init__(self, text: str, file: str) -> None:
        self.text = text
        self.file = file

    @cached_property
    def _line_starts(self) -> list[int]:
        return [0, *(match.end() for match in re.finditer("\n", self.text))]

    def position(self, offset: int) -> tuple[int, int]:
        """Line and column, both from 1, of the character at an offset."""
        line = bisect_right(self._line_starts, offset)
        return line, offset - self._line_starts[line - 1] + 1

    def span(self, start: int, end: int) -> Span:
        """The span of the characters from `start` up to, and without, `end`."""
        starts = self._line_starts
        line = bisect_right(starts, start)
        column = start - starts[line - 1] + 1
        if line == len(starts) or end < starts[line]:
            return Span(self.file, line, column, line, column + end - start)
        return Span(self.file, line, column, *self.position(end))


class Lexeme:
    """A word, a sign or a comment of a source.

    kind: the name of its terminal, such as "NAME" or "OPEN". text: its characters in the source, or the synthesised
    ones after a repair. start, end: offsets of the first character and of the one behind the last.
    """

    __slots__ = ("end", "kind", "source", "start", "text")

    def __init__(self, kind: str, text: str, start: int, end: int, source: Source) -> None:
        self.kind = kind
        self.text = text
        self.start = start
        self.end = end
        self.source = source

    @property
    def span(self) -> Span:
        return self.source.span(self.start, self.end)

    def synthesised(self, kind: str, text: str) -> Lexeme:
        """A synthesised lexeme at the position of this one."""
        return Lexeme(kind, text, self.start, self.end, self.source)

    def __repr__(self) -> str:
        return f"Lexeme({self.kind}, {self.text!r}, {self.start}..{self.end})"
