"""Collecting diagnostics while a file is checked."""

from __future__ import annotations

from collections.abc import Iterable

from skillwing.dsl.diagnostics.diagnostic import Diagnostic
from skillwing.dsl.naming import is_usable
from skillwing.dsl.reading.syntax import Word
from skillwing.dsl.spans import Span
from skillwing.dsl.suggest import closest, listed


class Report:
    """The problems found so far."""

    def __init__(self) -> None:
        self.diagnostics: list[Diagnostic] = []

    def add(
        self,
        code: str,
        span: Span | None,
        message: str,
        advice: str | None = None,
        related: tuple[Span, str] | None = None,
    ) -> None:
        """Report a problem. Only elements that were built in code have no span; they count as at the file's start."""
        self.diagnostics.append(Diagnostic(code, span or Span("", 1, 1, 1, 1), message, advice, related))

    def unknown(self, code: str, word: Word, kind: str, known: Iterable[str]) -> None:
        """Report a name that is not declared, with the one that was probably meant or with all there are."""
        names = tuple(known)
        guess = closest(word.text, names)
        advice = f"Did you mean `{guess}`?" if guess else f"There is {listed(names)}."
        self.add(code, word.span, f"There is no {kind} `{word.text}`.", advice)

    def declare(self, seen: dict[str, Word], word: Word, kind: str) -> bool:
        """Note a declaration; report it and return False if the name is taken or cannot be used."""
        if not word.text:
            return False
        first = seen.setdefault(word.text, word)
        if first is not word:
            message = f"The {kind} `{word.text}` is declared twice."
            self.add("SW016", word.span, message, "Rename or remove one of them.", (first.span, "first declared here"))
            return False
        if kind != "state" and not is_usable(word.text):  # States are never names in code, only texts.
            message = f"No {kind} can be called `{word.text}`."
            self.add("SW018", word.span, message, f"Choose another name, such as `{word.text.strip('_') or 'item'}_1`.")
        return True
