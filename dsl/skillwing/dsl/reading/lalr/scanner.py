"""The scanner, which cuts a source text into lexemes by one regular expression, made of a grammar's terminals."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from sys import intern

from lark.lexer import PatternStr, TerminalDef

from skillwing.dsl.reading.lexemes import Lexeme, Source

WHITE_SPACE = "WHITE_SPACE"
_OVERSIZED = "OVERSIZED_NUMBER"
BYTE_ORDER_MARK = "\ufeff"


class Scanner:
    """A scanner for texts of one dialect.

    If several terminals match, the one of higher priority wins, then the one that can be longest, as in Lark. Keywords
    and signs, which have a fixed text, are recognised by that text.
    """

    def __init__(self, terminals: Iterable[TerminalDef]) -> None:
        ordered = sorted(
            (terminal for terminal in terminals if terminal.name != WHITE_SPACE),
            key=lambda terminal: (
                -terminal.priority,
                -terminal.pattern.max_width,
                -len(terminal.pattern.value),
                terminal.name,
            ),
        )
        fixed = {
            terminal.name: terminal.pattern.value for terminal in ordered if isinstance(terminal.pattern, PatternStr)
        }
        # Lark's names are slow to compare.
        self._kinds = {text: intern(str(kind)) for kind, text in fixed.items()}
        # A word of letters is matched as a NAME, and then found among the fixed texts.
        alternatives = (
            re.escape(fixed[terminal.name])
            if terminal.name in fixed
            else f"(?P<{terminal.name}>{terminal.pattern.to_regexp()})"
            for terminal in ordered
            if not fixed.get(terminal.name, "").isidentifier()
        )
        # The glance ahead spares white space the whole list.
        self._pattern = re.compile(rf"(?=\S)(?:{'|'.join(alternatives)})")

    def scan(self, source: Source) -> tuple[Lexeme, ...]:
        """Cut the text. Every character is in a lexeme, or is white space or a byte order mark at the start.

        White space matches no terminal, so the search skips it.
        """
        text = source.text
        kind_of = self._kinds.get
        lexemes = tuple(
            [
                Lexeme(kind_of(found := match[0]) or match.lastgroup or "", found, match.start(), match.end(), source)
                for match in self._pattern.finditer(text, text.startswith(BYTE_ORDER_MARK))
            ]
        )
        for lexeme in lexemes:
            if lexeme.kind == _OVERSIZED and math.isfinite(
                float(lexeme.text)
            ):  # no regular expression finds the limit of 1.8e308
                lexeme.kind = "NUMBER"
        return lexemes
