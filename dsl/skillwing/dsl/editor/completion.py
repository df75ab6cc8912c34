"""What may be written at a place: the words that the grammar allows there, and the names that have a meaning there.

Which names those are is not said a second time here: a placeholder is put where the name would stand, and the index
tells where it looks for a name in that place.
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
from skillwing.dsl.editor.names import Kind, Scope
from skillwing.dsl.reading.dialect import dialect_of
from skillwing.dsl.reading.lexemes import COMMENT, Lexeme

_PLACEHOLDER = "placeholder_of_a_name"
# A name alone, or the shortest beginning of something that is read only as a whole.
_FORMS = (_PLACEHOLDER, f"{_PLACEHOLDER} -> {_PLACEHOLDER}")


@dataclass(frozen=True, slots=True)
class Completion:
    """text: what to put in the place of the characters between the two offsets; markdown: about it."""

    text: str
    kind: Kind | OneOf["keyword", "scalar"]
    markdown: str
    start: int
    end: int


def completions(document: Document, offset: int) -> tuple[Completion, ...]:
    """What fits at an offset, in place of the word there: names first, in the order of their declaration."""
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


def _scopes(document: Document, start: int, end: int) -> tuple[Scope, ...]:
    """Where a name at this place is looked for; nowhere if the place only declares one."""
    for form in _FORMS:
        text = f"{document.text[:start]} {form} {document.text[end:]}"
        found = Document(text, document.file).names.at(start + 1)
        if found is not None and found.name == _PLACEHOLDER:
            return found.scopes if found.uses else ()
    return ()


def _word_around(document: Document, offset: int) -> tuple[int, int]:
    """The word that the offset is in, or right behind; empty, at the offset, where there is none."""
    for position in (document.word_at(offset), document.word_at(offset - 1)):
        word = document.words[position] if position >= 0 else None
        if word is not None and word.text.isidentifier() and word.start <= offset <= word.end:
            return word.start, word.end
    return offset, offset


def _in_comment_or_string(document: Document, offset: int) -> bool:
    return any(lexeme.start < offset and _reaches(lexeme, offset) for lexeme in document.lexemes)


def _reaches(lexeme: Lexeme, offset: int) -> bool:
    """Whether an offset behind the start of a comment or string is still in it: lines may go on at their end."""
    goes_on = lexeme.text.startswith("//") or lexeme.kind in {"UNCLOSED_COMMENT", "UNCLOSED_STRING"}
    inside = offset < lexeme.end or (goes_on and offset == lexeme.end)
    return inside and (goes_on or lexeme.kind in {COMMENT, "STRING", "UNIT"})
