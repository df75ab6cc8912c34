"""The scanner, which cuts a source text into lexemes by one regular expression, made of a grammar's terminals."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from sys import intern

from skillwing.dsl.reading.lalr.grammar import TerminalSymbol
from skillwing.dsl.reading.lexemes import Lexeme, Source

_OVERSIZED = "OVERSIZED_NUMBER"
BYTE_ORDER_MARK = "\ufeff"


class Scanner:
    """A scanner for texts of one dialect.

    The first terminal that matches counts. Keywords and signs, which have a fixed text, are recognised by that text.
    """

    def __init__(self, terminals: Sequence[TerminalSymbol]) -> None:
        self._kinds = {each.text: intern(each.name) for each in terminals if each.text is not None}
        # A word of letters is matched as a NAME, and then found among the fixed texts.
        alternatives = (
            f"(?P<{each.name}>{each.expression})" if each.text is None else re.escape(each.text)
            for each in terminals
            if not (each.text or "").isidentifier()
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
