"""What stands at a place, in a few lines of Markdown."""

from __future__ import annotations

from dataclasses import dataclass

from skillwing.dsl.editor.description import describe
from skillwing.dsl.editor.document import Document
from skillwing.dsl.editor.glossary import glossary_of


@dataclass(frozen=True, slots=True)
class Hover:
    """markdown: about the words between the two offsets."""

    markdown: str
    start: int
    end: int


def hover(document: Document, offset: int) -> Hover | None:
    """About the name or the word of the language at an offset; None where nothing is to be said."""
    occurrence = document.names.at(offset)
    if occurrence is not None:
        if occurrence.symbol is None:
            return None
        return Hover(describe(document, occurrence.symbol), occurrence.start, occurrence.end)
    for position in (document.word_at(offset), document.word_at(offset - 1)):
        word = document.words[position] if position >= 0 else None
        if word is None or not word.start <= offset <= word.end:
            continue
        text = glossary_of(document.file).meaning(word.text, document.assigned(position))
        if text is not None:
            return Hover(text, word.start, word.end)
    return None
