"""The parser: from a source text to syntax nodes."""

from __future__ import annotations

import errno
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

from skillwing.dsl.diagnostics.diagnostic import Diagnostic
from skillwing.dsl.reading import syntax
from skillwing.dsl.reading.dialect import Dialect, OtherFileError, dialect_of, lex
from skillwing.dsl.reading.lexemes import COMMENT, Source
from skillwing.dsl.reading.recovery.broken_text import BrokenText, RecoveryReport
from skillwing.dsl.reading.recovery.repairs import Recovery
from skillwing.dsl.text_files import text_of_file

ReadText: TypeAlias = Callable[[Path], str]
"""A function that returns the text of a file. It raises OSError."""


@dataclass(frozen=True, slots=True)
class ParsedFile:
    """Result of parsing a file. root: None if nothing could be read. diagnostics: its syntax errors."""

    root: syntax.SkillsetSyntax | None
    diagnostics: tuple[Diagnostic, ...]
    recovery: RecoveryReport


def included_text(file: Path) -> str:
    """The text of an included file. Raises OSError, also for a device, whose text may have no end."""
    if file.exists() and not file.is_file():
        raise OSError(errno.EINVAL, "it is no file", str(file))
    return text_of_file(file)


def parse_file(text: str, file: str, read: ReadText = included_text) -> ParsedFile:
    """Parse a whole file in the dialect of its extension. Raises nothing, whatever the text contains.

    read: for the files that it includes, relative to its folder.
    """
    dialect = dialect_of(file)
    root, broken = recovered(dialect, text, file)
    if dialect.lower is not None:
        root = dialect.lower(root, file, lambda path: _other(dialect, path, read))
    return ParsedFile(
        root if isinstance(root, syntax.SkillsetSyntax) else None,
        tuple(broken.diagnostics),
        broken.recovery,
    )


def self_contained(text: str, file: str, read: ReadText = included_text) -> str:
    """A text of the same meaning that includes no other files. The file has no errors."""
    dialect = dialect_of(file)
    if dialect.inline is None:
        return text
    root, _ = recovered(dialect, text, file)
    return dialect.inline(root, lex(text, file), file, lambda path: _other(dialect, path, read))


def recovered(dialect: Dialect, text: str, file: str) -> tuple[object, BrokenText]:
    """The node of a text's start rule, None if nothing could be read, and the text with its diagnostics.

    file: name of the file, for the spans.
    """
    source = Source(text, file)
    lexemes = [lexeme for lexeme in dialect.scanner.scan(source) if lexeme.kind != COMMENT]
    broken = BrokenText(dialect, lexemes, source)
    return Recovery(broken).run(), broken


def _other(dialect: Dialect, path: Path, read: ReadText) -> object:
    try:
        text = read(path)
    except (OSError, ValueError) as error:  # a ValueError for a name that no file can have
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise OtherFileError(f"cannot be read: {reason}", is_text=False) from error
    root, broken = recovered(dialect, text, str(path))
    if broken.diagnostics:
        first = min(broken.diagnostics, key=lambda item: (item.span.line, item.span.column))
        raise OtherFileError(f"has an error at line {first.span.line}: {first.message.rstrip('.')}", is_text=True)
    return root
