"""The LALR machine: shifts lexemes and reduces rules by its tables, until an unexpected lexeme."""

from __future__ import annotations

from collections.abc import Sequence

from skillwing.dsl.reading.lalr.tables import Reduction, Tables
from skillwing.dsl.reading.lexemes import Lexeme


class Machine:
    """A parse in progress. states, values: the stack, where `values` lacks the start state.

    Code that changes the stack between two calls of `run` has to keep both in step.
    """

    def __init__(self, tables: Tables) -> None:
        self.actions = tables.actions
        self._gotos = tables.gotos
        self.states = [0]
        self.values: list[object] = []

    def run(self, lexemes: Sequence[Lexeme], at: int = 0) -> int:
        """Read lexemes from that index on. Returns the index of the first unexpected one, or their number.

        After the lexeme that ends the file, the root node is the first of the values.
        """
        actions, gotos, states, values = self.actions, self._gotos, self.states, self.values
        state = states[-1]
        for index in range(at, len(lexemes)):
            lexeme = lexemes[index]
            kind = lexeme.kind
            action = actions[state].get(kind)
            while isinstance(action, Reduction):
                size, build = action.size, action.build
                if build is None:
                    states.pop()
                elif size:
                    del states[-size:]
                    values[-size:] = (build(*values[-size:]),)
                else:
                    values.append(build())
                state = gotos[states[-1]][action.origin]
                states.append(state)
                action = actions[state].get(kind)
            if action is None:
                return index
            state = action
            states.append(state)
            values.append(lexeme)
        return len(lexemes)

    def reads(self, kind: str, stack: TrialStack) -> bool:
        """Shift a word of that kind on a trial stack, without building nodes. Returns False if it is not allowed."""
        while (action := self.actions[stack.top].get(kind)) is not None:
            if isinstance(action, int):
                stack.push(action)
                return True
            stack.pop(action.size)
            stack.push(self._gotos[stack.top][action.origin])
        return False


class TrialStack:
    """A trial stack of states. Changes are kept apart from the real stack below."""

    def __init__(self, states: Sequence[int], depth: int | None = None) -> None:
        """Start from the lowest `depth` states, or from all of them."""
        self._states = states
        self._depth = len(states) if depth is None else depth
        self._own: list[int] = []

    @property
    def top(self) -> int:
        return self._own[-1] if self._own else self._states[self._depth - 1]

    def push(self, state: int) -> None:
        self._own.append(state)

    def pop(self, count: int) -> None:
        own = min(count, len(self._own))
        del self._own[len(self._own) - own :]
        self._depth -= count - own

    def copy(self) -> TrialStack:
        other = TrialStack(self._states, self._depth)
        other._own = list(self._own)
        return other
