"""A source text as statements and blocks, with every comment in its place, for the formatter.

Only lexemes are used, not the grammar: a statement ends where the next word cannot continue it. So no text can get
lost, a wrong guess only changes the layout, and all dialects are treated alike.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from skillwing.dsl.reading.lexemes import COMMENT, Lexeme

# Signs that stand between two words of one statement.
_CONNECTORS = frozenset(
    {"COLON", "COMMA", "EQUALS", "ARROW", "UP_TO", "DOT", "COMPARATOR", "LESS", "MORE", "IMPLIES", "AND", "OR"}
)
# Words that continue a statement, unless they are names themselves: `period: float64`.
_OPTIONS = frozenset({"IN", "PERIOD", "VIOLATION", "POST", "MODIFIABLE", "SEC", "MS"})
# What waits for a word behind it, and what belongs to the word before it.
_PREFIXES = _CONNECTORS | _OPTIONS - {"MODIFIABLE", "SEC", "MS"} | {"OPEN_PAREN", "NOT"}
_SUFFIXES = _CONNECTORS | {"OPEN", "CLOSE_PAREN", "UNIT", "ARRAY"}
# Words that begin a statement and need another one.
_HEADINGS = frozenset(
    {"SKILLSET", "INCLUDE", "TYPE", "ENUM", "DATA", "PARAMETER", "RESOURCE", "INITIAL", "EXTERN", "TRANSITION"}
    | {"EVENT", "GUARD", "EFFECT", "SKILL", "INPUT", "OUTPUT", "PRECONDITION", "START", "INVARIANT", "MESSAGE"}
    | {"INTERRUPTING", "SUCCESS", "FAILURE", "POSTCONDITION"}
)


@dataclass(frozen=True, slots=True)
class Statement:
    """Words up to the next statement, and the block that ends them, if any. A comment alone is a statement, too.

    words: with the comments among them. remarks: comments behind it on its last line. after_blank: an empty line stands
    before it. breaks: indices of words that begin a line of the source.
    """

    words: tuple[Lexeme, ...]
    block: Block | None
    remarks: tuple[Lexeme, ...]
    after_blank: bool
    breaks: frozenset[int]

    @property
    def is_comment(self) -> bool:
        return self.block is None and all(word.kind == COMMENT for word in self.words)


@dataclass(frozen=True, slots=True)
class Block:
    """`{ ... }`. remarks: comments behind the opening bracket. on_one_line: it is so in the source."""

    statements: tuple[Statement, ...]
    remarks: tuple[Lexeme, ...]
    on_one_line: bool


def read_statements(text: str, lexemes: Sequence[Lexeme]) -> tuple[Statement, ...]:
    """Group the lexemes of a text whose brackets match."""
    return tuple(_Reader(text, lexemes).statements())


class _Reader:
    def __init__(self, text: str, lexemes: Sequence[Lexeme]) -> None:
        self._lexemes = lexemes
        ends = [0, *(lexeme.end for lexeme in lexemes)]
        starts = [*(lexeme.start for lexeme in lexemes), len(text)]
        # Line breaks before each lexeme, and behind the last.
        self._breaks = [text.count("\n", end, start) for end, start in zip(ends, starts, strict=True)]
        self._at = 0

    def statements(self) -> Iterator[Statement]:
        """The statements up to the end of the block or of the text."""
        while self._at < len(self._lexemes) and self._kind(self._at) != "CLOSE":
            yield self._statement()

    def _kind(self, index: int) -> str:
        return self._lexemes[index].kind if index < len(self._lexemes) else "CLOSE"

    def _statement(self) -> Statement:
        first = self._at
        after_blank = self._breaks[first] > 1
        self._at += 1
        block = None
        while not self._ends(first):
            self._at = self._next_word()
            if self._kind(self._at) == "OPEN":
                words = self._lexemes[first : self._at]
                block = self._block()
                break
            self._at += 1
        else:
            words = self._lexemes[first : self._at]
        breaks = frozenset(index for index in range(1, len(words)) if self._breaks[first + index])
        return Statement(tuple(words), block, tuple(self._remarks()), after_blank, breaks)

    def _next_word(self) -> int:
        """The index of the next lexeme that is no comment."""
        index = self._at
        while self._kind(index) == COMMENT:
            index += 1
        return index

    def _ends(self, first: int) -> bool:
        """True if the statement that began at `first` ends before the next word."""
        following = self._next_word()
        if self._kind(following) == "CLOSE":
            return True
        words = [lexeme.kind for lexeme in self._lexemes[first : self._at] if lexeme.kind != COMMENT]
        if not words:  # a comment: on the line of a statement it belongs to it, unless it takes lines of its own
            return "\n" in self._lexemes[self._at - 1].text or any(self._breaks[self._at : following + 1])
        if words.count("OPEN_PAREN") > words.count("CLOSE_PAREN"):
            return False
        kind, previous = self._kind(following), "NAME" if words[-2:-1] == ["ARROW"] else words[-1]
        option = kind in _OPTIONS and self._kind(following + 1) != "COLON"
        return not (previous in _PREFIXES or kind in _SUFFIXES or option or (len(words) == 1 and previous in _HEADINGS))

    def _block(self) -> Block:
        opening = self._at
        self._at += 1
        remarks = tuple(self._remarks())
        if remarks and not self._breaks[self._at]:  # they stand before a statement of a block on one line
            self._at -= len(remarks)
            remarks = ()
        statements = tuple(self.statements())
        self._at += 1
        source = self._lexemes[opening + 1 : self._at]
        broken = any(self._breaks[opening + 1 : self._at]) or any("\n" in lexeme.text for lexeme in source)
        return Block(statements, remarks, not broken)

    def _remarks(self) -> Iterator[Lexeme]:
        while self._kind(self._at) == COMMENT and not self._breaks[self._at]:
            self._at += 1
            yield self._lexemes[self._at - 1]
