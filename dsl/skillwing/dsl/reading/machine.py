"""The LALR machine: shifts lexemes and reduces rules as the tables say, until it cannot go on."""

from __future__ import annotations

from collections.abc import Sequence

from skillwing.dsl.reading.lexemes import Lexeme
from skillwing.dsl.reading.tables import Reduction, Tables


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

    def advance(self, states: list[int], kind: str) -> bool:
        """Shift a word of that kind on a stack of states alone, without building; False if it has no place there."""
        while (action := self.actions[states[-1]].get(kind)) is not None:
            if isinstance(action, int):
                states.append(action)
                return True
            del states[len(states) - action.size :]
            states.append(self._gotos[states[-1]][action.origin])
        return False
