"""Completion: the words that the grammar allows at an offset, and the names that are declared there.

The rules for names are not repeated here. A placeholder is inserted at the offset, and the index returns the scopes in
which it looks for that name.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal as OneOf

from skillwing.dsl.editor.description import describe
from skillwing.dsl.editor.document import Document
from skillwing.dsl.editor.glossary import glossary_of
from skillwing.dsl.editor.grammar_state import allowed_after
from skillwing.dsl.editor.index import TYPES
from skillwing.dsl.editor.names import NameScope, SymbolKind
from skillwing.dsl.reading.dialect import dialect_of
from skillwing.dsl.reading.lexemes import COMMENT, Lexeme

_PLACEHOLDER = "placeholder_of_a_name"
# A name alone, or the shortest beginning of something that is read only as a whole.
_FORMS = (_PLACEHOLDER, f"{_PLACEHOLDER} -> {_PLACEHOLDER}")


@dataclass(frozen=True, slots=True)
class Completion:
    """text: what to put in the place of the characters between the two offsets; markdown: about it."""

    text: str
    kind: SymbolKind | OneOf["keyword", "scalar"]
    markdown: str
    start: int
    end: int


def completions(document: Document, offset: int) -> tuple[Completion, ...]:
    """The completions at an offset, in place of the word there. Names come first, in the order of their declaration."""
    if _in_comment_or_string(document, offset):
        return ()
    start, end = _word_around(document, offset)
    before = [word for word in document.words if word.end <= start]
    dialect = dialect_of(document.file)
    allowed = allowed_after(before, dialect)
    names = list(_names(document, start, end)) if "NAME" in allowed else []
    keywords = sorted(kind.lower() for kind in allowed if dialect.vocabulary.is_word(kind))
    glossary = glossary_of(document.file)
    choices = glossary.choices.get(document.assigned(len(before)))
    meanings = choices or {word: glossary.keywords.get(word, "") for word in keywords}
    return (*names, *(Completion(word, "keyword", meaning, start, end) for word, meaning in meanings.items()))


def _names(document: Document, start: int, end: int) -> Iterator[Completion]:
    for scope in _scopes(document, start, end):
        for symbol in document.names.names(scope):
            yield Completion(symbol.name, scope.kind, describe(document, symbol), start, end)
        if scope == TYPES:
            for name, meaning in glossary_of(document.file).types.items():
                yield Completion(name, "scalar", meaning, start, end)


def _scopes(document: Document, start: int, end: int) -> tuple[NameScope, ...]:
    """The scopes in which a name at this offset is looked up; none if it is only declared there."""
    for form in _FORMS:
        text = f"{document.text[:start]} {form} {document.text[end:]}"
        found = Document(text, document.file).names.at(start + 1)
        if found is not None and found.name == _PLACEHOLDER:
            return found.scopes if found.uses else ()
    return ()


def _word_around(document: Document, offset: int) -> tuple[int, int]:
    """The word around the offset or right before it; empty if there is none."""
    for position in (document.word_at(offset), document.word_at(offset - 1)):
        word = document.words[position] if position >= 0 else None
        if word is not None and word.text.isidentifier() and word.start <= offset <= word.end:
            return word.start, word.end
    return offset, offset


def _in_comment_or_string(document: Document, offset: int) -> bool:
    return any(lexeme.start < offset and _reaches(lexeme, offset) for lexeme in document.lexemes)


def _reaches(lexeme: Lexeme, offset: int) -> bool:
    """True if an offset behind the start of a comment or string is inside it, also at the end of its line."""
    goes_on = lexeme.text.startswith("//") or lexeme.kind in {"UNCLOSED_COMMENT", "UNCLOSED_STRING"}
    inside = offset < lexeme.end or (goes_on and offset == lexeme.end)
    return inside and (goes_on or lexeme.kind in {COMMENT, "STRING", "UNIT"})
