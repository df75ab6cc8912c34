"""A file with errors under repair: its changed lexemes, its diagnostics, and the report of the recovery."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from skillwing.dsl.diagnostics.diagnostic import Diagnostic
from skillwing.dsl.reading.dialect import Dialect
from skillwing.dsl.reading.lalr.grammar import END
from skillwing.dsl.reading.lexemes import Lexeme, Source
from skillwing.dsl.reading.recovery.cursor import Cursor, OpenBracket
from skillwing.dsl.reading.vocabulary import BROKEN, capitalised, either
from skillwing.dsl.spans import Span

BEHIND_A_NAME = ("COLON", "OPEN")
"""Signs that cannot begin an item."""


@dataclass(slots=True)
class RecoveryReport:
    """Parts of a file that error recovery did not read, or read in another way than they are written.

    skipped_words: words of skipped text; a name that seems unknown may be declared there. nameless: keywords of the
    blocks without a name, or with something nameless in them. guessed: spans in statements that were changed. is_cut:
    the file ends in the middle, so that anything may be declared in the missing part.
    """

    skipped_words: set[str] = field(default_factory=set[str])
    nameless: set[str] = field(default_factory=set[str])
    guessed: list[Span] = field(default_factory=list[Span])
    is_cut: bool = False

    def skip(self, lexemes: Iterable[Lexeme]) -> None:
        for lexeme in lexemes:
            self.skipped_words.update(re.findall(r"\w+", lexeme.text))  # a comment that is never closed has many


class BrokenText:
    """The lexemes of a file, with a cursor that can change them.

    diagnostics: the problems reported so far. problems: their number, with those that follow from an unexpected end.
    """

    def __init__(self, dialect: Dialect, lexemes: Iterable[Lexeme], source: Source) -> None:
        self.diagnostics: list[Diagnostic] = []
        self.problems = 0
        self.recovery = RecoveryReport()
        self.words = dialect.vocabulary
        self._source = source
        read = list(lexemes)
        end = read[-1].end if read else 0
        self._last_word = read[-1].start if read else 0
        self._end_is_reported = False
        self.is_empty = not read
        self.cursor = Cursor(dialect, [*read, Lexeme(END, "", end, end, source)])

    def balance(self) -> int:
        """The number of opening brackets in the file minus that of closing ones."""
        return sum({"OPEN": 1, "CLOSE": -1}.get(lexeme.kind, 0) for lexeme in self.cursor.lexemes)

    def cut_behind(self, last: Lexeme) -> None:
        """Note that the file ends in the middle. That is one problem, whatever is missing behind its last word."""
        self.recovery.is_cut = True
        self._last_word = last.start
        if last.kind != "CLOSE":
            self.recovery.guessed.append(last.span)

    def hidden_behind(self, last: Lexeme) -> None:
        """Note that the rest of the file is in a comment without an end, which is reported already."""
        self._end_is_reported = True
        self.cut_behind(last)

    # --- changing it

    def pass_over(self, start: int, end: int) -> None:
        self.recovery.skip(self.cursor.lexemes[start:end])
        del self.cursor.lexemes[start:end]

    def replace(self, lexeme: Lexeme) -> None:
        self.cursor.lexemes[self.cursor.at] = lexeme

    def close(self, blocks: Sequence[OpenBracket], at: int) -> int:
        """Report blocks, innermost first, as not closed before a lexeme, and close them there. Returns their number."""
        lexemes = self.cursor.lexemes
        signs = [self.words.signs[block.closer] for block in blocks]
        titles = ", and of ".join(f"{block.title}, opened at line {block.line}" for block in blocks)
        text = f"`{' '.join(signs)}`"
        self.report(
            "SW001", self.behind(at), f"Missing {text} of {titles}.", f"Add {text} here, {self.before(lexemes[at])}."
        )
        lexemes[at:at] = [
            lexemes[at - 1].synthesised(block.closer, sign) for block, sign in zip(blocks, signs, strict=True)
        ]
        return len(blocks)

    # --- what it costs

    def doubt_statement(self) -> None:
        """Mark the statement before an unexpected word as guessed, because it may have taken too many words."""
        last = self.cursor.last
        if last is not None and last.kind != "CLOSE":
            self.recovery.guessed.append(last.span)

    def doubt_name(self, lexeme: Lexeme) -> None:
        """Mark the block as nameless if an unexpected sign may have stood behind the name of an item."""
        if lexeme.kind in BEHIND_A_NAME and self.cursor.reads([BROKEN]):
            self.recovery.nameless.update(block.keyword for block in self.cursor.blocks()[-1:])

    # --- reporting

    def behind(self, at: int) -> Span:
        """The position right behind the lexeme before that index."""
        return self._character(self.cursor.lexemes[at - 1].end if at else 0)

    def _character(self, offset: int) -> Span:
        line, column = self._source.position(offset)
        return Span(self._source.file, line, column, line, column + 1)

    def before(self, lexeme: Lexeme) -> str:
        return "at the end of the file" if lexeme.kind == END else f"before {self.words.lexeme_text(lexeme)}"

    def report(self, code: str, place: Lexeme | Span, message: str, advice: str) -> None:
        if isinstance(place, Lexeme):
            place = place.span if place.end > place.start else self._character(place.end)
        self.problems += 1
        if (place.line, place.column) >= self._source.position(self._last_word):
            if self._end_is_reported:
                return
            self._end_is_reported = True
        self.diagnostics.append(Diagnostic(code, place, message, advice))

    def report_unexpected(self, lexeme: Lexeme) -> None:
        blocks = self.cursor.blocks()
        where = f" in {blocks[-1].title}" if blocks else ""
        message = f"{capitalised(self.words.lexeme_text(lexeme))} has no place here{where}."
        home = self.words.homes.get(lexeme.kind)
        options = either([self.words.kind_text(kind) for kind in self.cursor.acceptable()])
        advice = f"It belongs into {home}; here may stand {options}." if home else f"Here may stand {options}."
        self.report("SW002", lexeme, message, advice)
