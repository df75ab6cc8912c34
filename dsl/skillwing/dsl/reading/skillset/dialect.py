"""The `.skillset` dialect: its grammar, its builder, and its terminals in words."""

from __future__ import annotations

from skillwing.dsl.reading.dialect import Dialect
from skillwing.dsl.reading.skillset.builder import SkillsetBuilder
from skillwing.dsl.reading.vocabulary import Vocabulary

_ELEMENTS = frozenset({"SKILL", "RESOURCE", "DATA", "TYPE", "ENUM", "EVENT"})

_SECTIONS = frozenset(
    {
        *("PROGRESS", "DEADLINE", "DISPATCH_TIMEOUT", "OWNER_LOST", "INPUT", "OUTPUT", "EFFECT"),
        *("PRECONDITION", "INVARIANT", "RESULT", "INTERRUPT", "LOST"),
    }
)

_VOCABULARY = Vocabulary(
    signs={
        "COLON": ":",
        "EQUALS": "=",
        "OPEN_PAREN": "(",
        "CLOSE_PAREN": ")",
        "ARROW": "->",
        "OPEN": "{",
        "UP_TO": "..",
        "COMPARATOR": "==",
        "IMPLIES": "=>",
        "CLOSE": "}",
    },
    others={
        "NAME": "a name",
        "NUMBER": "a number",
        "STRING": "a string",
        "UNIT": "a unit such as `[m]`",
        "ARRAY": "`[]`",
        "DOT": "`.`",
        "STAR": "`*`",
    },
    elements=_ELEMENTS,
    named_blocks=_ELEMENTS | {"SKILLSET"},
    homes={
        **dict.fromkeys(_SECTIONS, "a skill"),
        **dict.fromkeys(("STATE", "INITIAL", "EXTERN"), "a resource"),
        **dict.fromkeys(_ELEMENTS, "the skillset itself"),
        "GUARD": "an event",
        "PERIOD": "a datum",
        "MODIFIABLE": "an input",
        "VIOLATION": "an invariant",
        "APPLY": "a result, `interrupt` or `lost`",
        "POST": "a result",
        "TIMEOUT": "`interrupt`",
    },
)

SKILLSET = Dialect("skillset/skillset.lark", SkillsetBuilder(), _VOCABULARY)
