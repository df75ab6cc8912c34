"""Semantic tokens: the kind of each name, which a grammar of regular expressions cannot determine."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from skillwing.dsl.editor.document import Document
from skillwing.dsl.editor.names import SymbolKind

# The token types that every colour theme knows.
TOKEN_TYPES: Mapping[SymbolKind, str] = {
    "skillset": "namespace",
    "type": "type",
    "datum": "variable",
    "resource": "class",
    "event": "event",
    "skill": "function",
    "field": "property",
    "value": "enumMember",
    "state": "enumMember",
    "input": "parameter",
    "output": "property",
    "feedback": "property",
    "effect": "method",
    "precondition": "property",
    "invariant": "property",
    "result": "enumMember",
}


@dataclass(frozen=True, slots=True)
class Token:
    """A name between two offsets, with its kind, and whether it is declared here."""

    start: int
    end: int
    kind: SymbolKind
    declares: bool


def tokens(document: Document) -> Iterator[Token]:
    """The declared names, in the order of the text."""
    for place in document.names.occurrences:
        if place.symbol is not None:
            yield Token(place.start, place.end, place.symbol.kind, place.declares)
