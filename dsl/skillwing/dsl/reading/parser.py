"""The parser: from source text to syntax nodes, with every syntax problem of the file."""

from __future__ import annotations

from dataclasses import dataclass

from skillwing.dsl.diagnostics.diagnostic import Diagnostic
from skillwing.dsl.reading import syntax
from skillwing.dsl.reading.dialect import dialect_of
from skillwing.dsl.reading.lexemes import COMMENT, Source
from skillwing.dsl.reading.recovery.broken_text import BrokenText, RecoveryReport
from skillwing.dsl.reading.recovery.repairs import Recovery


@dataclass(frozen=True, slots=True)
class ParsedFile:
    """Result of parsing a file. root: None if nothing could be read. diagnostics: its syntax errors."""

    root: syntax.SkillsetSyntax | None
    diagnostics: tuple[Diagnostic, ...]
    recovery: RecoveryReport


def parse_file(text: str, file: str) -> ParsedFile:
    """Parse a whole file in the dialect of its extension. Raises nothing, whatever the text contains."""
    dialect = dialect_of(file)
    source = Source(text, file)
    lexemes = [lexeme for lexeme in dialect.scanner.scan(source) if lexeme.kind != COMMENT]
    broken = BrokenText(dialect, lexemes, source)
    root = Recovery(broken).run()
    return ParsedFile(
        root if isinstance(root, syntax.SkillsetSyntax) else None,
        tuple(broken.diagnostics),
        broken.recovery,
    )
