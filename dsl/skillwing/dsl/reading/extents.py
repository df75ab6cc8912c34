"""What a syntax node covers of its file."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Iterator
from typing import cast

from skillwing.dsl.reading.lexemes import Lexeme
from skillwing.dsl.spans import Span


def spans(node: object) -> Iterator[Span]:
    """The spans of a syntax node and of all its parts, in no order; nothing for what is no node."""
    left = [node]  # no recursion: a predicate may be nested as deeply as a file is long
    while left:
        part = left.pop()
        if isinstance(part, Span):
            yield part
        elif isinstance(part, Lexeme):
            yield part.span
        elif isinstance(part, tuple | list):
            left += cast("Iterable[object]", part)
        elif dataclasses.is_dataclass(part):
            left += (getattr(part, field.name) for field in dataclasses.fields(part))
