"""Dialects: the notations in which a skillset can be written, chosen by file extension."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from importlib.resources import files
from pathlib import Path
from typing import TypeAlias, cast

from lark import Lark
from lark.lexer import TerminalDef

from skillwing.dsl.reading.lalr.scanner import Scanner
from skillwing.dsl.reading.lalr.tables import Tables, tables
from skillwing.dsl.reading.lexemes import Lexeme, Source
from skillwing.dsl.reading.syntax import SkillsetSyntax
from skillwing.dsl.reading.vocabulary import Vocabulary


class OtherFileError(Exception):
    """A file that another one includes cannot be used. `str()` is the reason, behind the name of the file.

    is_text: its text could be read, and has an error.
    """

    def __init__(self, reason: str, is_text: bool) -> None:
        self.is_text = is_text
        super().__init__(reason)


ReadOther: TypeAlias = Callable[[Path], object]
"""A function that returns the node of another file. It raises OtherFileError."""
Lowering: TypeAlias = Callable[[object, str, ReadOther], SkillsetSyntax | None]
"""A function of the start rule's node and the name of its file. It returns None for any other node."""
Inlining: TypeAlias = Callable[[object, Sequence[Lexeme], str, ReadOther], str]
"""A function of the start rule's node, the lexemes of its text, the name of its file. The node has no error."""


@dataclass(frozen=True)
class Dialect:
    """A grammar for Lark, the builder of its nodes, and its terminals in words.

    grammar: path of its file below this folder. A rule `_unreadable`, which no other uses, holds the terminals that no
    rule accepts. builder: has one method per rule, called with the children. All texts share it, and it has no state.
    lower: makes the `SkillsetSyntax` of the start rule's node; None if it is one. inline: makes a text that needs no
    other files; None if none does. start: the grammar's start rule.
    """

    grammar: str
    builder: object
    vocabulary: Vocabulary
    lower: Lowering | None = None
    inline: Inlining | None = None
    start: str = "skillset"

    @cached_property
    def scanner(self) -> Scanner:
        return Scanner(cast("list[TerminalDef]", self._lark.terminals))

    @cached_property
    def tables(self) -> Tables:
        return tables(self._lark, self.start, self.builder)

    @cached_property
    def _lark(self) -> Lark:
        grammar = files("skillwing.dsl.reading").joinpath(self.grammar).read_text(encoding="utf-8")
        return Lark(
            grammar,
            source_path=__file__,  # the grammars import from one beside them
            parser="lalr",
            lexer="basic",
            start=[self.start, "_unreadable"],
            maybe_placeholders=True,
        )


def dialect_of(file: str) -> Dialect:
    """The dialect in which a file of that name is written: `.skillset` unless its extension says another."""
    # Each grammar is read when the first file needs it.
    if file.endswith(".rl"):
        from skillwing.dsl.reading.rl.dialect import RL  # noqa: PLC0415

        return RL
    from skillwing.dsl.reading.skillset.dialect import SKILLSET  # noqa: PLC0415

    return SKILLSET


def lex(text: str, file: str) -> tuple[Lexeme, ...]:
    """Cut a text, comments included, in the dialect of the file's extension.

    Every character is in a lexeme, or is white space or a byte order mark at the start, whatever the text may be.
    """
    return dialect_of(file).scanner.scan(Source(text, file))
