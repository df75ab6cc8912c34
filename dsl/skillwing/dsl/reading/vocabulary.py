"""The vocabulary of a dialect: the kinds of its terminals and their names for the user."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from skillwing.dsl.reading.lalr.grammar import END
from skillwing.dsl.reading.lexemes import Lexeme

BROKEN = "_BROKEN"  # stands in the grammar where an element was given up
_UNREADABLE = frozenset(
    {
        *("UNCLOSED_COMMENT", "UNCLOSED_STRING", "UNCLOSED_BRACKET", "UNKNOWN_CHARACTER"),
        *("OVERSIZED_NUMBER", "HALF_NUMBER", "FOREIGN"),
    }
)
_NO_WORDS = _UNREADABLE | {BROKEN, END}
_BEHIND_A_HEADING = frozenset({"NAME", "OPEN"})
_NAMES = frozenset({"NAME", "STAR"})
_NAMES_OF_A_LIST = frozenset({"NAME", "CLOSE", BROKEN})
CLOSERS = {"OPEN": "CLOSE", "OPEN_PAREN": "CLOSE_PAREN"}


@dataclass(frozen=True)
class Vocabulary:
    """The terminals of a dialect. Terminals that are not listed are keywords, `SKILL` for `skill`.

    signs: punctuation with its text, in the order in which a missing sign is tried. Blocks are between OPEN and CLOSE,
    parentheses between OPEN_PAREN and CLOSE_PAREN. others: descriptions of terminals without a fixed text. elements:
    keywords that begin an element of a skillset. named_blocks: keywords before a name and a block. homes: for keywords
    that are allowed in one kind of block only, that block.
    """

    signs: Mapping[str, str]
    others: Mapping[str, str]
    elements: frozenset[str]
    named_blocks: frozenset[str]
    homes: Mapping[str, str] = field(default_factory=dict[str, str])
    _no_words: frozenset[str] = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_no_words", _NO_WORDS | self.signs.keys() | self.others.keys())

    def is_word(self, kind: str) -> bool:
        """True if a terminal is a keyword."""
        return kind not in self._no_words

    def may_be_name(self, kind: str, follower: str, fitting: Iterable[str]) -> bool:
        """True if a keyword may be a name where one is allowed: if it does not begin a block.

        Before a name or a bracket it seems to begin one. There it is a name only if nothing but a name is allowed.
        fitting: the terminals that the parser allows there.
        """
        return self.is_word(kind) and (follower not in _BEHIND_A_HEADING or _NAMES.issuperset(fitting))

    def may_be_listed(self, kind: str, fitting: Iterable[str]) -> bool:
        """True if a keyword may be a name in a list of names whose `}` is not missing."""
        return self.is_word(kind) and _NAMES_OF_A_LIST.issuperset(fitting)

    def block_title(self, heading: Sequence[object]) -> str:
        """The name of a block, from the words before its bracket."""
        match heading[-2:]:
            case [Lexeme(kind=kind) as keyword, Lexeme(kind="NAME") as name] if kind in self.named_blocks:
                return f"{keyword.text} `{name.text}`"
            case [Lexeme(kind="EQUALS"), Lexeme(kind="NUMBER")]:
                return "`progress`"
            case [Lexeme() as word, Lexeme(kind="EQUALS")]:
                return f"`{word.text}=(`"
            case [*_, Lexeme() as word] if word.kind not in self.signs:
                return f"`{word.text}`"
            case _:
                return "the parenthesis"

    def belongs_into(self, kind: str, title: str) -> bool:
        """True if a keyword is allowed only in blocks like the one of that title."""
        keyword = title.partition(" ")[0]
        return self.homes.get(kind) in {f"a {keyword}", f"an {keyword}"}

    def kind_text(self, kind: str) -> str:
        """A terminal in words for the user."""
        if kind == END:
            return "the end of the file"
        return f"`{self.signs[kind]}`" if kind in self.signs else self.others.get(kind, f"`{kind.lower()}`")

    def lexeme_text(self, lexeme: Lexeme) -> str:
        """A lexeme in words for the user, shortened to fit into a sentence."""
        return self.kind_text(END) if lexeme.kind == END else f"`{_shortened(lexeme.text)}`"


def _shortened(text: str) -> str:
    first, *rest = text.split("\n")
    return f"{first[:40]}..." if rest or len(first) > 40 else first


def capitalised(text: str) -> str:
    return text[0].upper() + text[1:]


def either(options: Sequence[str]) -> str:
    if not options:
        return "nothing more"
    return options[0] if len(options) == 1 else f"{', '.join(options[:-1])} or {options[-1]}"
