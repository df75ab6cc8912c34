"""What the grammar allows at a place in a text, whatever stands before it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import zip_longest

from skillwing.dsl.reading.dialect import Dialect
from skillwing.dsl.reading.lalr.machine import Machine, Outlook
from skillwing.dsl.reading.lexemes import Lexeme
from skillwing.dsl.reading.vocabulary import CLOSERS


def allowed_after(words: Sequence[Lexeme], dialect: Dialect) -> frozenset[str]:
    """The terminals that may follow these words, as kinds. words: everything before the place, without comments."""
    states = _States(dialect)
    for word, follower in zip_longest(words, words[1:]):
        states.read(word.kind, follower.kind if follower else "")
    return states.allowed()


@dataclass(frozen=True, slots=True)
class _Block:
    """A bracket that is open. closer: kind of the sign that closes it; stack: the parser's states at its start."""

    closer: str
    stack: Outlook


class _States:
    """The parser's states while it reads a text, without building anything.

    Where a word has no place, the words of its block so far are forgotten: what may stand at a block's start may
    stand there again. (The parser's own recovery mends more, and looks ahead for it to what is not yet written.)
    """

    def __init__(self, dialect: Dialect) -> None:
        self._vocabulary = dialect.vocabulary
        self._machine = Machine(dialect.tables)
        self._stack = Outlook(self._machine.states)
        self._blocks = [_Block("", self._stack)]

    def read(self, kind: str, follower: str) -> None:
        """follower: kind of the word behind, which tells whether a word of the language is a name."""
        closes = any(block.closer == kind for block in self._blocks)
        while closes and self._blocks[-1].closer != kind:
            self._blocks.pop()
        if not self._shift(kind, follower):
            self._stack = self._blocks[-1].stack
            if not self._shift(kind, follower) and closes:
                self._stack = self._blocks[-2].stack
        if kind in CLOSERS:
            self._blocks.append(_Block(CLOSERS[kind], self._stack))
        elif closes:
            self._blocks.pop()

    def allowed(self) -> frozenset[str]:
        kinds = self._machine.actions[self._stack.top]
        return frozenset(kind for kind in kinds if kind.isupper() and self._after(kind) is not None)

    def _shift(self, kind: str, follower: str) -> bool:
        after = self._after(kind)
        if after is None and self._vocabulary.may_be_name(kind, follower, self._machine.actions[self._stack.top]):
            after = self._after("NAME")
        if after is None:
            return False
        self._stack = after
        return True

    def _after(self, kind: str) -> Outlook | None:
        stack = self._stack.copy()
        return stack if self._machine.reads(kind, stack) else None
