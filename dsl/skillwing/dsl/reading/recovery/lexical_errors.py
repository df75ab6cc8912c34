"""Lexical errors: unknown characters and signs, which are reported and replaced before the parse continues."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Sequence

from skillwing.dsl.diagnostics.diagnostic import Diagnostic
from skillwing.dsl.expressions import literal_text
from skillwing.dsl.reading.lexemes import Lexeme
from skillwing.dsl.reading.vocabulary import Vocabulary
from skillwing.dsl.spans import Span

# What other languages write, with the terminal and the text that stand for it here.
_FOREIGN = {
    **dict.fromkeys(("&", "&&"), ("AND", "and")),
    **dict.fromkeys(("|", "||"), ("OR", "or")),
    "!": ("NOT", "not"),
    "===": ("COMPARATOR", "=="),
    **dict.fromkeys(("!==", "<>", "≠"), ("COMPARATOR", "!=")),
    "≤": ("COMPARATOR", "<="),
    "≥": ("COMPARATOR", ">="),
    **dict.fromkeys(("-->", "→"), ("ARROW", "->")),
    "⇒": ("IMPLIES", "=>"),
}
_SEPARATORS = frozenset({",", ";"})


def fix_lexical_errors(lexemes: Sequence[Lexeme], words: Vocabulary) -> tuple[list[Lexeme], list[Diagnostic]]:
    """Return the lexemes with all lexical errors replaced or removed, and the diagnostics."""
    errors = _LexicalErrors(lexemes, words)
    errors.fix()
    return errors.fixed, errors.diagnostics


class _LexicalErrors:
    def __init__(self, lexemes: Sequence[Lexeme], words: Vocabulary) -> None:
        self.fixed: list[Lexeme] = []
        self.diagnostics: list[Diagnostic] = []
        self._lexemes = lexemes
        self._words = words
        self._parentheses = 0

    def fix(self) -> None:
        at = 0
        while at < len(self._lexemes):
            at += self._fix(at)

    def _fix(self, at: int) -> int:
        """Handle the lexeme at an index; return the number of lexemes that were handled."""
        lexeme = self._lexemes[at]
        match lexeme.kind:
            case "UNCLOSED_COMMENT":
                place = lexeme.source.span(lexeme.start, lexeme.start + 2)
                self._report(place, "This comment is never closed.", "Close it with `*/`.")
            case "UNCLOSED_STRING":
                self._report(lexeme.span, "This string is never closed.", 'Close it with `"` on the same line.')
                self.fixed.append(lexeme.synthesised("STRING", '""'))
            case "UNCLOSED_BRACKET":
                self._report(lexeme.span, "This bracket is never closed.", f"Write `{lexeme.text}]`.")
            case "OVERSIZED_NUMBER":
                self._report(lexeme.span, "This number is too large.", "Write one of at most 1.79e308.")
                self.fixed.append(lexeme.synthesised("NUMBER", "1"))
            case "HALF_NUMBER":
                self._half_number(lexeme)
            case "FOREIGN":
                self._foreign(lexeme)
            case "UNKNOWN_CHARACTER":
                return self._unknown(at)
            case _:
                self._parentheses += {"OPEN_PAREN": 1, "CLOSE_PAREN": -1}.get(lexeme.kind, 0)
                self.fixed.append(lexeme)
        return 1

    def _half_number(self, lexeme: Lexeme) -> None:
        whole, _, fraction = lexeme.text.partition(".")
        number = f"{whole if whole[-1:].isdigit() else whole + '0'}.{fraction or 0}"
        self._report(lexeme.span, "A number has digits on both sides of its point.", f"Write `{number}`.")
        self.fixed.append(lexeme.synthesised("NUMBER", number))

    def _foreign(self, lexeme: Lexeme) -> None:
        text = lexeme.text
        if text.startswith("#"):
            place = lexeme.source.span(lexeme.start, lexeme.start + 1)
            self._report(place, "Comments do not begin with `#`.", "Write `//`.", "SW005")
            return
        if text.startswith("'"):
            meant = ("STRING", literal_text(text[1:-1]))
        elif text == ":=":
            meant = ("COMPARATOR", "==") if self._parentheses > 0 else ("EQUALS", "=")
        else:
            meant = _FOREIGN[text]
        self._report(lexeme.span, f"The language does not write `{text}`.", f"Write `{meant[1]}`.", "SW005")
        self.fixed.append(lexeme.synthesised(*meant))

    # --- unknown characters

    def _unknown(self, at: int) -> int:
        lexeme = self._lexemes[at]
        behind = self._lexemes[at + 1] if at + 1 < len(self._lexemes) else lexeme
        before = self.fixed[-1] if self.fixed else lexeme
        sides = [
            self._is_name(before) and before.end == lexeme.start,
            self._is_name(behind) and behind.start == lexeme.end,
        ]
        if lexeme.text not in _SEPARATORS and (all(sides) or lexeme.text.isalpha()):
            return self._misshapen_name(at, self.fixed.pop() if sides[0] else lexeme)
        run = [lexeme]
        for other in self._lexemes[at + 1 :]:
            if other.kind != "UNKNOWN_CHARACTER" or other.start != run[-1].end:
                break
            run.append(other)
        message = f"The language has no character `{shown(lexeme.text)}`."
        advice = "Elements need no separator between them." if lexeme.text in _SEPARATORS else "Remove it."
        self._report(lexeme.span, message, advice)
        return len(run)

    def _misshapen_name(self, at: int, first: Lexeme) -> int:
        """Join the parts of a name with characters that names cannot have."""
        count, end = 0, self._lexemes[at].start
        for piece in self._lexemes[at:]:
            if piece.start != end or not (piece.kind == "UNKNOWN_CHARACTER" or self._is_name(piece)):
                break
            count, end = count + 1, piece.end
        source = first.source
        text = source.text[first.start : end]
        name = "".join(_for_names(character) for character in text)
        advice = "Write it of letters from a to z, digits and `_`"
        if name.strip("_"):
            advice += f", like `{name}`"
        else:
            name = text  # nothing of it can be kept: at least different names stay different
        strange = next(character for character in text if not re.match(r"\w", character, re.ASCII))
        message = f"A name cannot hold the character `{shown(strange)}`."
        self._report(source.span(first.start, end), message, f"{advice}.")
        self.fixed.append(Lexeme("NAME", name, first.start, end, source))
        return count

    def _is_name(self, lexeme: Lexeme) -> bool:
        return lexeme.kind == "NAME" or self._words.is_word(lexeme.kind)

    def _report(self, span: Span, message: str, advice: str, code: str = "SW004") -> None:
        self.diagnostics.append(Diagnostic(code, span, message, advice))


def _for_names(character: str) -> str:
    """The replacement of a character in a name: a letter without its accent, or `_`."""
    plain = unicodedata.normalize("NFKD", character).encode("ascii", "ignore").decode()
    return plain if re.fullmatch(r"\w+", plain) else "_"


def shown(text: Iterable[str]) -> str:
    """A text with its invisible characters written as code points."""
    return "".join(character if character.isprintable() else f"U+{ord(character):04X}" for character in text)
