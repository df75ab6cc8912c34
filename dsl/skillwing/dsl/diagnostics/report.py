"""Collection of diagnostics during a check."""

from __future__ import annotations

from collections.abc import Iterable

from skillwing.dsl.diagnostics.diagnostic import Diagnostic
from skillwing.dsl.naming import is_usable
from skillwing.dsl.spans import Span, Word
from skillwing.dsl.suggest import closest, listed


class DiagnosticReport:
    """The problems found so far. lost: spans of elements that were left out because of an error elsewhere."""

    def __init__(self) -> None:
        self.diagnostics: list[Diagnostic] = []
        self.lost: list[Span] = []

    def add(
        self,
        code: str,
        span: Span | None,
        message: str,
        advice: str | None = None,
        related: tuple[Span, str] | None = None,
    ) -> None:
        """Report a problem. Elements that were built in code have no span and count as at the start of the file."""
        self.diagnostics.append(Diagnostic(code, span or Span("", 1, 1, 1, 1), message, advice, related))

    def unknown(self, code: str, word: Word, kind: str, known: Iterable[str]) -> None:
        """Report an undeclared name, with the one that was probably meant, or with all that exist.

        kind: "resource", or "state of `wheels`" for a part of something.
        """
        names = tuple(known)
        guess = closest(word.text, names)
        noun, _, owner = kind.partition(" of ")
        message = f"{owner} has no {noun} `{word.text}`." if owner else f"There is no {noun} `{word.text}`."
        if guess:
            advice = f"Did you mean `{guess}`?"
        elif names:
            advice = f"There is {listed(names)}."
        else:
            advice = f"Declare it: {_DECLARATIONS.get(code, '`{}`').format(word.text)}."
        self.add(code, word.span, message, advice)

    def declare(self, seen: dict[str, Word], word: Word, kind: str) -> bool:
        """Note a declaration; report a name that cannot be used. Returns False, and reports it, for a taken name."""
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


# How to declare what there is none of.
_DECLARATIONS = {
    "SW010": "`resource {0} {{ initial A  A -> B  B -> A }}`",
    "SW012": "`effect {{ {0}: RESOURCE -> STATE }}` in this skill",
    "SW014": "`data {{ {0}: float64 period=1.0 }}` in the skillset, or `input {{ {0}: float64 }}` in the skill",
    "SW015": "`{0}: float64` in the type",
}
