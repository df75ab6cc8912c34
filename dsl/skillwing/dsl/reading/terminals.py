"""The terminals of the grammar, by kind and in words for the reader."""

from __future__ import annotations

from collections.abc import Sequence

from lark import Token

END = "$END"
BROKEN = "BROKEN"

SIGNS = {
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
}
OTHERS = {
    END: "the end of the file",
    "NAME": "a name",
    "NUMBER": "a number",
    "STRING": "a string",
    "UNIT": "a unit such as `[m]`",
    "ARRAY": "`[]`",
    "DOT": "`.`",
    "STAR": "`*`",
}
UNREADABLE = frozenset({"UNCLOSED_COMMENT", "UNCLOSED_STRING", "UNCLOSED_BRACKET", "UNKNOWN_CHARACTER"})
NO_WORDS = frozenset({*SIGNS, *OTHERS, *UNREADABLE, "OVERSIZED_NUMBER", BROKEN})
TOP_LEVEL = frozenset({"SKILL", "RESOURCE", "DATA", "TYPE", "ENUM", "EVENT"})
NAMED_BLOCKS = TOP_LEVEL | {"SKILLSET"}
CLOSERS = {"OPEN": "CLOSE", "OPEN_PAREN": "CLOSE_PAREN"}


def may_be_name(kind: str, follower: str) -> bool:
    """A word of the language is read as a name where it fits as one and does not begin a block or an element."""
    return kind not in NO_WORDS and follower not in {"OPEN", "NAME"}


def block_title(heading: Sequence[object]) -> str:
    """Name a block by the words in front of its bracket."""
    match heading[-2:]:
        case [Token(type=kind) as keyword, Token(type="NAME") as name] if kind in NAMED_BLOCKS:
            return f"{keyword} `{name}`"
        case [Token(type="EQUALS"), Token(type="NUMBER")]:
            return "`progress`"
        case [Token() as word, Token(type="EQUALS")]:
            return f"`{word}=(`"
        case [*_, Token() as word] if word.type not in SIGNS:
            return f"`{word}`"
        case _:
            return "the parenthesis"


def token_text(token: Token) -> str:
    return OTHERS[END] if token.type == END else f"`{_shortened(token)}`"


def _shortened(text: str) -> str:
    first, *rest = text.split("\n")
    return f"{first[:40]}..." if rest or len(first) > 40 else first


def capitalised(text: str) -> str:
    return text[0].upper() + text[1:]


def kind_text(kind: str) -> str:
    return f"`{SIGNS[kind]}`" if kind in SIGNS else OTHERS.get(kind, f"`{kind.lower()}`")


def either(options: Sequence[str]) -> str:
    if not options:
        return "nothing more"
    return options[0] if len(options) == 1 else f"{', '.join(options[:-1])} or {options[-1]}"
