"""The `.rlc` dialect: its grammar, its builder, and its terminals in words."""

from __future__ import annotations

from skillwing.dsl.reading.dialect import Dialect
from skillwing.dsl.reading.rlc.builder import RlcBuilder
from skillwing.dsl.reading.vocabulary import Vocabulary

_VOCABULARY = Vocabulary(
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
