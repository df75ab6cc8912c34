"""A notation in which a skillset can be written: what one file extension's texts are read with."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from importlib.resources import files
from typing import cast

from lark import Lark
from lark.lexer import TerminalDef

from skillwing.dsl.reading.lalr.scanner import Scanner
from skillwing.dsl.reading.lalr.tables import Tables, tables
from skillwing.dsl.reading.vocabulary import Vocabulary


@dataclass(frozen=True)
class Dialect:
    """A grammar for Lark beside this module, what builds the nodes of its rules, and its terminals in words.

    The grammar starts at the rule `skillset`, whose node is a `SkillsetSyntax`. A rule `_unreadable`, which no other
    uses, holds the terminals that no rule accepts. builder: has one method per rule, called with the children; it is
    shared by all texts and keeps nothing.
    """

    grammar: str
    builder: object
    vocabulary: Vocabulary

    @cached_property
    def scanner(self) -> Scanner:
        return Scanner(cast("list[TerminalDef]", self._lark.terminals))

    @cached_property
    def tables(self) -> Tables:
        return tables(self._lark, "skillset", self.builder)

    @cached_property
    def _lark(self) -> Lark:
        grammar = files("skillwing.dsl.reading").joinpath(self.grammar).read_text(encoding="utf-8")
        return Lark(
            grammar,
            source_path=__file__,  # the grammars import from one beside them
            parser="lalr",
            lexer="basic",
            start=["skillset", "_unreadable"],
            maybe_placeholders=True,
        )
