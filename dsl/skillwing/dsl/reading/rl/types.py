"""The types of an `.rl` file, which declares only their names. The robot's middleware defines their contents."""

from __future__ import annotations

from collections.abc import Iterable

from skillwing.dsl.diagnostics.report import DiagnosticReport
from skillwing.dsl.reading.rl.includes import Included
from skillwing.dsl.reading.syntax import CoinedWord, StructSyntax, TypeUse
from skillwing.dsl.spans import Word
from skillwing.dsl.suggest import closest

# Declared names that can only mean one thing, in any letter case.
_SCALARS = {
    **{name: name for name in ("bool", "string", "float32", "float64")},
    **{f"{sign}int{bits}": f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)},
    "boolean": "bool",
    "byte": "uint8",
    "double": "float64",
    "float": "float64",
    "int": "int64",
    "integer": "int64",
    "real": "float64",
    "str": "string",
    "uint": "uint64",
}


class RlTypes:
    """The declared types, and those of included files. structures: those of unknown contents, without fields.

    Of the included ones only those in use are among the structures.
    """

    def __init__(self, declared: Iterable[Word], included: Included, report: DiagnosticReport) -> None:
        self._report = report
        self._declared: dict[str, Word] = {}
        self._unknown: dict[str, StructSyntax] = {}
        structures: list[StructSyntax] = []
        for word in declared:
            if word.text.casefold() in _SCALARS and word.text not in self._declared:
                self._declared[word.text] = word
            elif report.declare(self._declared, word, "type"):
                structures.append(StructSyntax(word, ()))
        self._structures = structures
        self._may_be_included = not included.is_whole
        self._included: dict[str, StructSyntax] = {}
        for word in included.types:
            if word.text in self._declared:
                continue
            if word.text.casefold() in _SCALARS:
                self._declared[word.text] = word
            elif report.declare(self._declared, word, "type"):
                self._included[word.text] = StructSyntax(word, ())
        self._remarked: set[str] = set()

    @property
    def structures(self) -> tuple[StructSyntax, ...]:
        included = (structure for name, structure in self._included.items() if name in self._remarked)
        return (*self._structures, *included, *self._unknown.values())

    def use(self, use: TypeUse) -> TypeUse:
        """The type in use. An undeclared one is reported and then treated as declared."""
        word = use.name
        scalar = _SCALARS.get(word.text.casefold())
        if scalar is not None and (word.text in self._declared or self._may_be_included):
            return TypeUse(CoinedWord(scalar, word.span), ())
        if word.text in self._declared:
            self._remark(self._declared[word.text])
            return use
        if not self._may_be_included:
            guess = closest(word.text, self._declared)
            advice = (
                f"Did you mean `{guess}`?" if guess else f"Declare it in front of the skillset: `type {word.text}`."
            )
            self._report.add("SW013", word.span, f"There is no type `{word.text}`.", advice)
        self._unknown.setdefault(word.text, StructSyntax(word, ()))
        return use

    def _remark(self, word: Word) -> None:
        if word.text not in self._remarked:
            self._remarked.add(word.text)
            message = f"What `{word.text}` holds is not said here: it is read as a structure without fields."
            advice = f"To give it some, write `type {word.text} {{ ... }}` in a `.skillset` file."
            self._report.add("SW090", word.span, message, advice)
