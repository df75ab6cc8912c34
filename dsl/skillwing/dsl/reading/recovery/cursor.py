"""The state of a parse: the words ahead, and the words that the machine could read next."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from skillwing.dsl.reading.dialect import Dialect
from skillwing.dsl.reading.lalr.grammar import END
from skillwing.dsl.reading.lalr.machine import Machine, TrialStack
from skillwing.dsl.reading.lalr.tables import Tables
from skillwing.dsl.reading.lexemes import Lexeme
from skillwing.dsl.reading.syntax import spans
from skillwing.dsl.reading.vocabulary import BROKEN, CLOSERS

_LOOKAHEAD = 3  # words behind a repair that the parser has to be able to read


@dataclass(frozen=True, slots=True)
class OpenBracket:
    """An open bracket. title: `skill drive` or `input` for the user; closer: the terminal that ends it."""

    title: str
    line: int
    closer: str

    @property
    def keyword(self) -> str:
        return self.title.strip("`").partition(" ")[0]


class Cursor:
    """A machine between two lexemes of a file.

    lexemes: all of the file, END included; at: index of the next one; is_balanced: whether each written bracket has its
    partner.
    """

    def __init__(self, dialect: Dialect, lexemes: list[Lexeme]) -> None:
        self.lexemes = lexemes
        self.at = 0
        self.is_balanced = True
        self.machine = Machine(dialect.tables)
        self._tables: Tables = dialect.tables
        self._words = dialect.vocabulary
        self.mark()

    @property
    def next(self) -> Lexeme:
        return self.lexemes[self.at]

    @property
    def last(self) -> Lexeme | None:
        """The lexeme that was read last; None at the start of the file."""
        return self.lexemes[self.at - 1] if self.at else None

    def run(self) -> bool:
        """Read on to the next error; return True if there is none."""
        self.at = self.machine.run(self.lexemes, self.at)
        return self.at == len(self.lexemes)

    def restart(self) -> None:
        """Parse again from the start, with the present lexemes."""
        self.machine = Machine(self._tables)
        self.at = 0
        self.mark()

    # --- going back one word

    def mark(self) -> None:
        """Remember this position. Words that are read from here on can be taken back."""
        machine = self.machine
        # The machine goes on filling the lists that repetitions are collected in.
        self._marked = self.at, list(machine.states), _with_lists_copied(machine.values)

    def before_last(self) -> Machine | None:
        """The machine before it read the last word; None if that was before the mark."""
        at, states, values = self._marked
        if at >= self.at:
            return None
        earlier = Machine(self._tables)
        earlier.states, earlier.values = list(states), _with_lists_copied(values)
        earlier.run(self.lexemes[at : self.at - 1])
        return earlier

    def go_back(self, earlier: Machine) -> None:
        """Stand before the last word, with the machine from `before_last`."""
        self.machine = earlier
        self.at -= 1

    # --- looking ahead

    def kind_at(self, offset: int) -> str:
        index = self.at + offset
        return self.lexemes[index].kind if index < len(self.lexemes) else END

    def kinds_from(self, offset: int, count: int = _LOOKAHEAD) -> list[str]:
        """The kinds of the words ahead, up to the end of the block if all brackets match.

        Words behind the block may contain an error of their own.
        """
        kinds = [lexeme.kind for lexeme in self.lexemes[self.at + offset : self.at + offset + count]]
        return kinds[: kinds.index("CLOSE") + 1] if self.is_balanced and "CLOSE" in kinds else kinds

    def trial_stack(self) -> TrialStack:
        return TrialStack(self.machine.states)

    def reads(self, kinds: Sequence[str], stack: TrialStack | None = None) -> bool:
        """True if the machine could read words of these kinds from here, or from another stack."""
        trial = self.trial_stack() if stack is None else stack.copy()
        for kind, follower in zip(kinds, [*kinds[1:], ""], strict=True):
            fitting = self.machine.actions[trial.top]
            as_name = kind not in fitting and self._words.may_be_name(kind, follower, fitting)
            if not self.machine.reads("NAME" if as_name else kind, trial):
                return False
        return True

    def acceptable(self, stack: TrialStack | None = None) -> list[str]:
        """The kinds of words that the machine could read next."""
        top = (stack or self.trial_stack()).top
        return sorted(kind for kind in self.machine.actions[top] if kind != BROKEN and self.reads([kind], stack))

    def section_ahead(self) -> int | None:
        """The number of words in the section or element that begins here, such as `skill a { ... }` or `deadline=9`."""
        is_assigned = self.kind_at(1) == "EQUALS"
        heading = 3 if is_assigned else 2 if self.kind_at(1) == "NAME" else 1
        if self.kind_at(heading) == "OPEN":
            return self.behind_blocks(self.at + heading + 1, 1) - self.at
        return heading if is_assigned else None

    # --- the blocks around

    def behind_blocks(self, at: int, count: int) -> int:
        """The index behind the brackets that close so many blocks around an index; that of END if they do not."""
        opened = count
        for index in range(at, len(self.lexemes) - 1):
            opened += {"OPEN": 1, "CLOSE": -1}.get(self.lexemes[index].kind, 0)
            if opened == 0:
                return index + 1
        return len(self.lexemes) - 1

    def start_of(self, values: Sequence[object]) -> int:
        """The index of the first lexeme of these values, which are the last on the stack."""
        start = min(((span.line, span.column) for span in spans(values)), default=None)
        index = self.at
        while index and start is not None and self._position(index - 1) >= start:
            index -= 1
        return index

    def _position(self, index: int) -> tuple[int, int]:
        lexeme = self.lexemes[index]
        return lexeme.source.position(lexeme.start)

    def blocks(self) -> list[OpenBracket]:
        """The open brackets, outermost first. They are on the machine's stack until their rule ends."""
        values = self.machine.values
        blocks: list[OpenBracket] = []
        for index, value in enumerate(values):
            if isinstance(value, Lexeme) and value.kind in CLOSERS.values():
                blocks.pop()  # closed, and only waiting for the word behind it
            elif isinstance(value, Lexeme) and value.kind in CLOSERS:
                blocks.append(self._block(values[max(0, index - 2) : index], value))
        return blocks

    def block_opened_by(self, index: int) -> OpenBracket:
        """The block whose bracket is the lexeme at that index."""
        return self._block(self.lexemes[max(0, index - 2) : index], self.lexemes[index])

    def _block(self, heading: Sequence[object], bracket: Lexeme) -> OpenBracket:
        return OpenBracket(self._words.block_title(heading), bracket.span.line, CLOSERS[bracket.kind])


def _with_lists_copied(values: Iterable[object]) -> list[object]:
    return [[*value] if isinstance(value, list) else value for value in values]
