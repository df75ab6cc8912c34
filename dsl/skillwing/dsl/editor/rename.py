"""Renaming of a name at all its occurrences, without a change of meaning."""

from __future__ import annotations

import re
from dataclasses import dataclass

from skillwing.dsl.checking.types import SCALARS
from skillwing.dsl.diagnostics.diagnostic import Diagnostic
from skillwing.dsl.editor.document import Document
from skillwing.dsl.editor.index import TYPES
from skillwing.dsl.editor.names import Occurrence, Symbol

_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


class RenameRefusedError(ValueError):
    """The name cannot be changed, or not to this one. The message is a sentence for the user."""


@dataclass(frozen=True, slots=True)
class Edit:
    """Put `text` in the place of the characters between the two offsets."""

    start: int
    end: int
    text: str


def renameable(document: Document, offset: int) -> Occurrence:
    """The name at an offset. Raises RenameRefusedError where there is none that the file declares."""
    occurrence = document.names.at(offset)
    if occurrence is None:
        raise RenameRefusedError("There is no name here that can be changed.")
    if occurrence.symbol is None:
        raise RenameRefusedError(f"`{occurrence.name}` is not declared in this file.")
    return occurrence


def rename(document: Document, offset: int, name: str) -> tuple[Edit, ...]:
    """The edits that rename the symbol at an offset, in the order of the text.

    Raises RenameRefusedError if the new name is not usable, is taken, or would change the meaning of another name.
    """
    occurrence = renameable(document, offset)
    symbol = occurrence.symbol
    assert symbol is not None
    if name == symbol.name:
        return ()
    _refuse_unusable(document, symbol, name)
    _refuse_unread(document, symbol)
    edits = tuple(Edit(place.start, place.end, name) for place in document.names.of(symbol))
    renamed = Document(applied(document.text, edits), document.file)
    _refuse_other_meaning(document, renamed, symbol, name)
    _refuse_new_errors(document, renamed)
    return edits


def applied(text: str, edits: tuple[Edit, ...]) -> str:
    """The text after edits that do not overlap and are in order."""
    pieces: list[str] = []
    at = 0
    for edit in edits:
        pieces += [text[at : edit.start], edit.text]
        at = edit.end
    return "".join([*pieces, text[at:]])


def _refuse_unusable(document: Document, symbol: Symbol, name: str) -> None:
    if not _NAME.fullmatch(name):
        raise RenameRefusedError(
            f"`{name}` is not a name. Use letters, digits and underscores, and do not start with a digit."
        )
    if symbol.scope == TYPES and name in SCALARS:
        raise RenameRefusedError(f"`{name}` is a built-in type. Choose another name.")
    taken = Symbol(symbol.scope, name)
    if taken in document.names.declarations:
        raise RenameRefusedError(f"The {taken.title} exists already. Choose another name.")


def _refuse_unread(document: Document, symbol: Symbol) -> None:
    """Reject names in text with a syntax error, because their meaning is unknown."""
    known = {place.start for place in document.names.occurrences}
    for word in document.words:
        if word.kind == "NAME" and word.text == symbol.name and word.start not in known:
            line = document.lines.line(word.start)
            raise RenameRefusedError(
                f"`{symbol.name}` also stands in line {line}, which cannot be read. Fix that first."
            )


def _refuse_other_meaning(before: Document, after: Document, symbol: Symbol, name: str) -> None:
    """Compare the meaning of every name of the text."""
    meanings = [place.symbol for place in before.names.occurrences]
    expected = [meaning and meaning.after_renaming(symbol, name) for meaning in meanings]
    found = [place.symbol for place in after.names.occurrences]
    if found == expected:
        return
    places = zip(after.names.occurrences, expected, strict=False)
    changed = next((place for place, meaning in places if place.symbol != meaning), None)
    where = "" if changed is None else f" in line {after.lines.line(changed.start)}"
    raise RenameRefusedError(f"`{name}` would be read as something else{where}. Choose another name.")


def _refuse_new_errors(before: Document, after: Document) -> None:
    known = [problem.code for problem in _errors(before)]
    for problem in _errors(after):
        if problem.code in known:
            known.remove(problem.code)
        else:
            raise RenameRefusedError(f"{problem.message} Choose another name.")


def _errors(document: Document) -> list[Diagnostic]:
    return [problem for problem in document.checked.diagnostics if problem.severity == "error"]
