"""The terminals that the grammar allows at an offset, also behind text with errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import zip_longest

from skillwing.dsl.reading.dialect import Dialect
from skillwing.dsl.reading.lalr.machine import Machine, TrialStack
from skillwing.dsl.reading.lexemes import Lexeme
from skillwing.dsl.reading.vocabulary import CLOSERS


def allowed_after(words: Sequence[Lexeme], dialect: Dialect) -> frozenset[str]:
    """The kinds of terminals allowed after these words. words: all before the offset, without comments."""
    states = _States(dialect)
    for word, follower in zip_longest(words, words[1:]):
        states.read(word.kind, follower.kind if follower else "")
    return states.allowed()


@dataclass(frozen=True, slots=True)
class _Block:
    """An open bracket. closer: kind of the sign that closes it; stack: the parser's states at its start."""

    closer: str
    stack: TrialStack


class _States:
    """The parser's states while it reads a text, without building nodes.

    After an unexpected word the words of its block so far are forgotten: all that may begin the block is allowed again.
    (The parser's own recovery repairs more, but it needs the words ahead.)
    """

    def __init__(self, dialect: Dialect) -> None:
        self._vocabulary = dialect.vocabulary
        self._machine = Machine(dialect.tables)
        self._stack = TrialStack(self._machine.states)
        self._blocks = [_Block("", self._stack)]

    def read(self, kind: str, follower: str) -> None:
        """Read a word. follower: kind of the next word, which decides whether a keyword is a name."""
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

    def _after(self, kind: str) -> TrialStack | None:
        stack = self._stack.copy()
        return stack if self._machine.reads(kind, stack) else None
