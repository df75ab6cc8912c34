"""A text in an editor: its lexemes, names and problems, each computed on first use."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping
from functools import cached_property
from textwrap import dedent

from skillwing.dsl.checking.checker import Checked, check
from skillwing.dsl.editor.index import index
from skillwing.dsl.editor.names import Index, Symbol, SymbolKind
from skillwing.dsl.editor.positions import Lines
from skillwing.dsl.printing.reference.descriptions import Descriptions
from skillwing.dsl.reading import syntax
from skillwing.dsl.reading.dialect import lex
from skillwing.dsl.reading.lexemes import COMMENT, Lexeme
from skillwing.dsl.reading.parser import parse_file
from skillwing.dsl.spans import Span

_AFTER_KEYWORD: frozenset[SymbolKind] = frozenset({"skillset", "type", "resource", "event", "skill"})
_SINGLE_WORDS: frozenset[SymbolKind] = frozenset({"state", "value"})


class Document:
    """The text of a file in an editor. It is immutable: another text is another document.

    file: its name, whose extension selects the dialect.
    """

    def __init__(self, text: str, file: str) -> None:
        self.text = text
        self.file = file
        self.lines = Lines(text)

    @cached_property
    def lexemes(self) -> tuple[Lexeme, ...]:
        """Every lexeme, comments included."""
        return lex(self.text, self.file)

    @cached_property
    def words(self) -> tuple[Lexeme, ...]:
        """Every lexeme but the comments."""
        return tuple(lexeme for lexeme in self.lexemes if lexeme.kind != COMMENT)

    @cached_property
    def root(self) -> syntax.SkillsetSyntax | None:
        """Syntax tree of the readable part; None if nothing is readable."""
        return parse_file(self.text, self.file).root

    @cached_property
    def names(self) -> Index:
        return index(self.root, self.lines, self.words)

    @cached_property
    def descriptions(self) -> Descriptions:
        """The comments by element."""
        return Descriptions(self.text, self.file)

    @cached_property
    def checked(self) -> Checked:
        return check(self.text, self.file)

    @cached_property
    def blocks(self) -> Mapping[int, int]:
        """Blocks: by the offset of each `{`, the offset behind its `}`. Without a `}` it is the end of the text."""
        blocks: dict[int, int] = {}
        opened: list[int] = []
        for word in self.words:
            if word.kind == "OPEN":
                opened.append(word.start)
            elif word.kind == "CLOSE" and opened:
                blocks[opened.pop()] = word.end
        return blocks | dict.fromkeys(opened, len(self.text))

    def word_at(self, offset: int) -> int:
        """The index in `words` of the last one that starts at the offset or before it; -1 if there is none."""
        return bisect_right(self._starts, offset) - 1

    def assigned(self, position: int) -> str:
        """The keyword that a word is the value of: `x` if `x=` stands before it, else empty."""
        before = self.words[max(0, position - 2) : position]
        return before[0].text if len(before) == 2 and before[1].kind == "EQUALS" else ""

    def range(self, span: Span) -> tuple[int, int]:
        """The offsets of a span, at least one character wide where there is one."""
        start = self.lines.offset(span.line, span.column)
        end = self.lines.offset(span.end_line, span.end_column)
        return start, max(end, min(start + 1, len(self.text)))

    @cached_property
    def _starts(self) -> list[int]:
        return [word.start for word in self.words]


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
    return start, max([place.end, *(document.range(span)[1] for span in syntax.spans(declaration.node))])


def excerpt(document: Document, symbol: Symbol) -> str:
    """The text of the declaration, without the indentation that all its lines share."""
    found = extent(document, symbol)
    if found is None:
        return symbol.name
    start, end = found
    column = start - document.text.rfind("\n", 0, start) - 1
    return dedent(" " * column + document.text[start:end])
