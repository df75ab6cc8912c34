"""Predicates as relations: which combinations of states satisfy an expression.

Every predicate is enumerated once, over all declared states of the resources that it names, and judged by `evaluate`
as it is at run time. The number of combinations is bounded, for one predicate and for a whole file.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import product
from math import prod
from typing import TypeAlias

from skillwing.dsl.expressions import Environment, Expression, evaluate, names_used, references
from skillwing.dsl.model import Resource

MOST_COMBINATIONS = 4096
"""Of states of the resources that one predicate names; a wider predicate is not judged."""
_MOST_IN_ALL = 40_000
"""Of combinations that are looked at in one file, so that an editor may check it at every keystroke."""

Row: TypeAlias = tuple[str, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Relation:
    """The combinations of states that satisfy a predicate. rows: the states of `names`, in this order.

    Equal predicates share one relation, so relations are compared by identity.
    """

    names: Row
    rows: frozenset[Row]


class Relations:
    """Turns the predicates of one skillset into relations, each once."""

    def __init__(self, resources: Iterable[Resource]) -> None:
        self._states = {resource.name: resource.states for resource in resources}
        self._known: dict[Expression, Relation | None] = {}
        self._left = _MOST_IN_ALL
        self.too_wide: dict[Expression, int] = {}
        """Predicates on resources that are not judged, and how many combinations they have."""

    def of(self, expression: Expression) -> Relation | None:
        """Return None for what speaks of data or inputs, which may be anything, and for what is too wide to judge."""
        if expression not in self._known:
            self._known[expression] = self._enumerated(expression)
        return self._known[expression]

    def _enumerated(self, expression: Expression) -> Relation | None:
        if any(name.scope != "resource" for name in references(expression)):
            return None
        names = tuple(sorted(names_used(expression)))
        combinations = prod(len(self._states[name]) for name in names)
        if combinations > min(MOST_COMBINATIONS, self._left):
            self.too_wide[expression] = combinations
            return None
        self._left -= combinations
        rows = product(*(self._states[name] for name in names))
        satisfying = (row for row in rows if evaluate(expression, Environment(dict(zip(names, row, strict=True)))))
        return Relation(names, frozenset(satisfying))
