"""Quick fixes: replacements for misspelt words."""

from __future__ import annotations

from dataclasses import dataclass

from skillwing.dsl.diagnostics.diagnostic import Diagnostic
from skillwing.dsl.editor.completion import completions
from skillwing.dsl.editor.document import Document
from skillwing.dsl.editor.rename import Edit
from skillwing.dsl.suggest import closest

_MISSPELT = "SW003"


@dataclass(frozen=True, slots=True)
class QuickFix:
    """A quick fix. title: for the menu; edit: the change; diagnostic: the problem that it fixes."""

    title: str
    edit: Edit
    diagnostic: Diagnostic


def fixes(document: Document, start: int, end: int) -> tuple[QuickFix, ...]:
    """The fixes for the problems that touch the characters between two offsets."""
    found: list[QuickFix] = []
    for diagnostic in document.checked.diagnostics:
        place = document.range(diagnostic.span)
        if place[0] <= end and start <= place[1]:
            found += _meant(document, diagnostic, place[1])
    return tuple(found)


def _meant(document: Document, diagnostic: Diagnostic, offset: int) -> list[QuickFix]:
    """The fitting word that resembles the word before the offset most, if that one does not fit."""
    occurrence = document.names.at(offset)
    is_name = occurrence is not None and occurrence.symbol is not None
    # A misspelt word of the language may stand where a name could.
    if is_name and diagnostic.code != _MISSPELT:
        return []
    fitting = completions(document, offset)
    if not fitting:
        return []
    start, end = fitting[0].start, fitting[0].end
    words = [completion.text for completion in fitting]
    written = document.text[start:end]
    meant = None if written in words else closest(written, words)
    return [] if meant is None else [QuickFix(f"Change to `{meant}`", Edit(start, end, meant), diagnostic)]
