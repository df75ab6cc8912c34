"""The outline of a file, and its folding ranges."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal as OneOf

from skillwing.dsl.editor.document import Document, extent
from skillwing.dsl.editor.names import Symbol, SymbolKind
from skillwing.dsl.reading.lexemes import COMMENT


@dataclass(frozen=True, slots=True)
class OutlineEntry:
    """A declaration. start, end: offsets of all of it; name_start, name_end: of its name."""

    name: str
    kind: SymbolKind
    start: int
    end: int
    name_start: int
    name_end: int
    children: tuple[OutlineEntry, ...]


@dataclass(frozen=True, slots=True)
class Fold:
    """Lines that fold into the first, both counted from 0 as in the protocol."""

    first_line: int
    last_line: int
    kind: OneOf["block", "comment"]


def outline(document: Document) -> tuple[OutlineEntry, ...]:
    """The skillset with its elements and their parts, in the order of the file.

    Elements outside the skillset, such as types in `.rl` files, stand beside it.
    """
    owned: dict[Symbol | None, list[Symbol]] = {}
    for symbol in document.names.declarations:
        owned.setdefault(symbol.owner, []).append(symbol)
    top = sorted(_entries(document, owned, owned.get(None, [])), key=lambda entry: entry.start)
    inside = {
        whole: tuple(entry for entry in top if entry is not whole and whole.start <= entry.start < whole.end)
        for whole in top
        if whole.kind == "skillset"
    }
    nested = {entry for entries in inside.values() for entry in entries}
    return tuple(replace(entry, children=inside.get(entry, entry.children)) for entry in top if entry not in nested)


def _entries(
    document: Document, owned: dict[Symbol | None, list[Symbol]], symbols: list[Symbol]
) -> Iterator[OutlineEntry]:
    for symbol in symbols:
        place = document.names.declarations[symbol].place
        whole = extent(document, symbol)
        if place is not None and whole is not None:
            children = sorted(_entries(document, owned, owned.get(symbol, [])), key=lambda entry: entry.start)
            yield OutlineEntry(symbol.name, symbol.kind, *whole, place.start, place.end, tuple(children))


def folds(document: Document) -> tuple[Fold, ...]:
    """Blocks and comments of several lines. The line with the closing bracket stays."""
    found: list[Fold] = []
    for start, end in document.blocks.items():
        last = _line(document, end) - (1 if document.text[end - 1 : end] == "}" else 0)
        found.append(Fold(_line(document, start), last, "block"))
    found += _comments(document)
    return tuple(sorted((fold for fold in found if fold.last_line > fold.first_line), key=lambda fold: fold.first_line))


def _comments(document: Document) -> Iterator[Fold]:
    """Comments over several lines, and comments on lines that follow each other."""
    first, end = 0, None
    for lexeme in document.lexemes:
        if lexeme.kind != COMMENT:
            continue
        joined = end is not None and document.text[end : lexeme.start].strip(" \t\r") == "\n"
        if not joined and end is not None:
            yield Fold(first, _line(document, end), "comment")
        if not joined:
            first = _line(document, lexeme.start)
        end = lexeme.end
    if end is not None:
        yield Fold(first, _line(document, end), "comment")


def _line(document: Document, offset: int) -> int:
    return document.lines.to_protocol(offset)[0]
