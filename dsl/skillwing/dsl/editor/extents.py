"""Extents of declarations: from their first word to their last, blocks included."""

from __future__ import annotations

from textwrap import dedent

from skillwing.dsl.editor.document import Document
from skillwing.dsl.editor.names import Symbol, SymbolKind
from skillwing.dsl.reading.syntax import spans

_AFTER_KEYWORD: frozenset[SymbolKind] = frozenset({"skillset", "type", "resource", "event", "skill"})
_SINGLE_WORDS: frozenset[SymbolKind] = frozenset({"state", "value"})


def extent(document: Document, symbol: Symbol) -> tuple[int, int] | None:
    """Offsets of a declaration's first character and behind its last; None if it is not in the text."""
    declaration = document.names.declarations[symbol]
    place = declaration.place
    if place is None:
        return None
    if symbol.kind in _SINGLE_WORDS:
        return place.start, place.end
    position = document.word_at(place.start)
    start = document.words[position - 1].start if symbol.kind in _AFTER_KEYWORD and position else place.start
    follower = document.words[position + 1].start if position + 1 < len(document.words) else place.end
    if follower in document.blocks:
        return start, document.blocks[follower]
    return start, max([place.end, *(document.range(span)[1] for span in spans(declaration.node))])


def excerpt(document: Document, symbol: Symbol) -> str:
    """The text of the declaration, without the indentation that all its lines share."""
    found = extent(document, symbol)
    if found is None:
        return symbol.name
    start, end = found
    column = start - document.text.rfind("\n", 0, start) - 1
    return dedent(" " * column + document.text[start:end])
