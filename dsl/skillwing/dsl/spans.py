"""Spans of source files, and words with a span."""

from __future__ import annotations

from typing import NamedTuple, Protocol


class Span(NamedTuple):
    """A range of source text. Lines and columns count from 1; `end_column` is the first column behind it."""

    file: str
    line: int
    column: int
    end_line: int
    end_column: int

    def to(self, other: Span) -> Span:
        """Return the range from the start of this span to the end of `other`."""
        return Span(self.file, self.line, self.column, other.end_line, other.end_column)

    def __str__(self) -> str:
        return f"{self.file}:{self.line}:{self.column}"


class Word(Protocol):
    """A name, a unit or another single word."""

    @property
    def text(self) -> str: ...
    @property
    def span(self) -> Span: ...
