"""The terminals of the `.rl` dialect in words."""

from __future__ import annotations

from skillwing.dsl.reading.vocabulary import Vocabulary

RL_WORDS = Vocabulary(
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
