"""The `.rl` dialect: its grammar, its builder, and its terminals in words."""

from __future__ import annotations

from skillwing.dsl.reading.dialect import Dialect
from skillwing.dsl.reading.rl.builder import RlBuilder
from skillwing.dsl.reading.rl.includes import inlined
from skillwing.dsl.reading.rl.lowering import lowered
from skillwing.dsl.reading.vocabulary import Vocabulary

_VOCABULARY = Vocabulary(
    signs={
        "COLON": ":",
        "OPEN_PAREN": "(",
        "CLOSE_PAREN": ")",
        "ARROW": "->",
        "OPEN": "{",
        "COMPARATOR": "==",
        "IMPLIES": "=>",
        "CLOSE": "}",
        "COMMA": ",",
        "LESS": "<",
        "MORE": ">",
        "EQUALS": "=",
    },
    others={
        "NAME": "a name",
        "NUMBER": "a number",
        "STRING": "a file name in quotes",
        "UNIT": "a unit",
    },
    elements=frozenset({"SKILL", "RESOURCE", "DATA", "EVENT", "PARAMETER"}),
    named_blocks=frozenset({"SKILLSET", "SKILL", "RESOURCE", "EVENT", "SUCCESS", "FAILURE", "INVARIANT"}),
)

RL = Dialect("rl/rl.lark", RlBuilder(), _VOCABULARY, lowered, inlined)
