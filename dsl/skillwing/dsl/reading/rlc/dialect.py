"""The `.rlc` dialect: its grammar, its builder, and its terminals in words."""

from __future__ import annotations

from collections.abc import Sequence

from skillwing.dsl.reading.dialect import Dialect
from skillwing.dsl.reading.lexemes import Lexeme
from skillwing.dsl.reading.rlc.builder import RlcBuilder
from skillwing.dsl.reading.rlc.syntax import SkillCallNode
from skillwing.dsl.reading.vocabulary import Vocabulary


class _RlcVocabulary(Vocabulary):
    """The vocabulary, with names for the blocks behind a node: of a composition, and of a `match`."""

    def block_title(self, heading: Sequence[object]) -> str:
        match heading:
            case [*_, SkillCallNode()]:
                return "the `match`"
            case [*_, last] if not isinstance(last, Lexeme):
                return "the composition"
            case _:
                return super().block_title(heading)


_VOCABULARY = _RlcVocabulary(
    signs={
        "COLON": ":",
        "OPEN_PAREN": "(",
        "CLOSE_PAREN": ")",
        "THEN": ">>",
        "ALONGSIDE": "||",
        "COMMA": ",",
        "IMPLIES": "=>",
        "BAR": "|",
        "OPEN": "{",
        "CLOSE": "}",
        "DOT": ".",
        "EQUALS": "=",
        "ARROW": "->",
        "MORE": ">",
    },
    others={
        "NAME": "a name",
        "NUMBER": "a number",
        "STRING": "a text in quotes",
        "REST": "`_`",
        "ARRAY": "`[]`",
    },
    elements=frozenset(),
    named_blocks=frozenset({"DEF"}),
)

RLC = Dialect("rlc/rlc.lark", RlcBuilder(), _VOCABULARY, start="compositions")
