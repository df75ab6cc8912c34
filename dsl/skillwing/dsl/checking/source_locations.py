"""Source locations: the element and the statement that a span belongs to."""

from __future__ import annotations

import dataclasses
from bisect import bisect
from collections.abc import Iterator
from functools import cached_property
from typing import TypeAlias, cast

from skillwing.dsl.reading import syntax
from skillwing.dsl.reading.lexemes import Lexeme
from skillwing.dsl.reading.syntax import field_names, spans
from skillwing.dsl.spans import Span

_Position: TypeAlias = tuple[int, int]


class SourceLocations:
    """The elements and statements of a file by their positions."""

    def __init__(self, root: syntax.SkillsetSyntax) -> None:
        self._root = root

    @cached_property
    def _elements(self) -> list[tuple[_Position, _Position, syntax.Element]]:
        """Start, end and node of each element, in the order of their starts. A file without errors needs none."""
        found = ((*_extent(element), element) for element in self._root.elements if not _is_empty(element))
        return sorted(found, key=lambda each: each[0])

    def at(self, span: Span) -> syntax.Element | None:
        """The innermost element around a span, or else the last one before it. Elements may be nested by mistake."""
        place = _start(span)
        before = [(end, element) for start, end, element in self._elements if start <= place]
        around = [element for end, element in before if place < end]
        return around[-1] if around else before[-1][1] if before else None

    @property
    def last(self) -> syntax.Element | None:
        """The element that begins last; None if there is none."""
        return self._elements[-1][-1] if self._elements else None

    def statement(self, span: Span) -> int:
        """The number of the last statement, such as a field, that begins before the span."""
        return bisect(self._statements, _start(span))

    @cached_property
    def _statements(self) -> list[_Position]:
        return sorted(_starts(self._root))


def _starts(node: object) -> Iterator[_Position]:
    """The starts of the statements in a node: the items of all its lists."""
    for name in field_names(type(node)):
        value: object = getattr(node, name)
        if isinstance(value, tuple):
            for item in cast("tuple[object, ...]", value):
                if isinstance(item, Lexeme):
                    yield _start(item.span)
                elif dataclasses.is_dataclass(item):
                    yield from sorted(map(_start, spans(item)))[:1]
                    yield from _starts(item)


def _is_empty(element: syntax.Element) -> bool:
    return next(spans(element), None) is None


def _extent(element: syntax.Element) -> tuple[_Position, _Position]:
    """The position of an element's name, and the position behind its last word."""
    found = list(spans(element))
    return min(map(_start, found)), max((span.end_line, span.end_column) for span in found)


def _start(span: Span) -> _Position:
    return span.line, span.column
