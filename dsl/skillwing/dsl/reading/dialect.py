"""Dialects: the notations in which a skillset can be written, chosen by file extension."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TypeAlias

from skillwing.dsl.reading.lalr.grammar import Grammar, from_json, to_json
from skillwing.dsl.reading.lalr.scanner import Scanner
from skillwing.dsl.reading.lalr.tables import Tables, tables
from skillwing.dsl.reading.lexemes import Lexeme, Source
from skillwing.dsl.reading.syntax import SkillsetSyntax
from skillwing.dsl.reading.vocabulary import Vocabulary

READING = Path(__file__).parent
"""Folder of the grammars. They import from one beside this file."""


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
    """A grammar in Lark's notation, the builder of its nodes, and its terminals in words.

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
        return Scanner(self._analysed.terminals)

    @cached_property
    def tables(self) -> Tables:
        return tables(self._analysed, self.builder)

    @property
    def stored(self) -> Path:
        """The file of the analysed grammar."""
        return (READING / self.grammar).with_suffix(".json")

    def analysed_again(self) -> str:
        """The analysed grammar, as it belongs into `stored`."""
        return to_json(self._analyse(), self._digest)

    @cached_property
    def _analysed(self) -> Grammar:
        """The stored grammar. Lark analyses one that has changed since: that takes as long as the rest of a start."""
        try:
            known = from_json(self.stored.read_text(encoding="utf-8"), self._digest)
        except FileNotFoundError:
            known = None
        return known or self._analyse()

    def _analyse(self) -> Grammar:
        from skillwing.dsl.reading.lalr.analysis import analyse  # noqa: PLC0415 - loads Lark

        return analyse((READING / self.grammar).read_text(encoding="utf-8"), str(READING), self.start)

    @cached_property
    def _digest(self) -> str:
        files = (READING / self.grammar, READING / "lexical.lark")
        return hashlib.sha256(b"".join([*(file.read_bytes() for file in files), self.start.encode()])).hexdigest()


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
