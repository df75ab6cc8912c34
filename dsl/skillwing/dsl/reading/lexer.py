"""From source text to lexemes."""

from __future__ import annotations

from skillwing.dsl.reading.dialects import dialect_of
from skillwing.dsl.reading.lexemes import Lexeme, Source


def lex(text: str, file: str) -> tuple[Lexeme, ...]:
    """Cut a text, comments included, in the dialect of the file's extension.

    Every character is in a lexeme, or is white space or a byte order mark at the start, whatever the text may be.
    """
    return dialect_of(file).scanner.scan(Source(text, file))
