"""The LALR machine: shifts lexemes and reduces rules as the tables say, until it cannot go on."""

from __future__ import annotations

from collections.abc import Sequence

from skillwing.dsl.reading.lalr.tables import Reduction, Tables
from skillwing.dsl.reading.lexemes import Lexeme


class Machine:
    """One parse under way. states, values: the stack, where `values` lacks the start state.

    Whoever changes the stack between two calls of `run` keeps the two in step.
    """

    def __init__(self, tables: Tables) -> None:
        self.actions = tables.actions
        self._gotos = tables.gotos
        self.states = [tables.start]
        self.values: list[object] = []

    def run(self, lexemes: Sequence[Lexeme], at: int = 0) -> int:
        """Read on from the lexeme at that index; return the index of the first that has no place, or their number.

        When the lexeme that ends the file has been read, the root node is the first of the values.
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

    def reads(self, kind: str, stack: Outlook) -> bool:
        """Shift a word of that kind on a stack on trial, without building; False if it has no place there."""
        while (action := self.actions[stack.top].get(kind)) is not None:
            if isinstance(action, int):
                stack.push(action)
                return True
            stack.pop(action.size)
            stack.push(self._gotos[stack.top][action.origin])
        return False


class Outlook:
    """A stack of states on trial: changes stand on top of a real stack, which stays as it is."""

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

    def copy(self) -> Outlook:
        other = Outlook(self._states, self._depth)
        other._own = list(self._own)
        return other
