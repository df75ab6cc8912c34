"""Predicates as relations: the combinations of states that satisfy an expression.

Each predicate is enumerated once over all declared states of its resources and evaluated by `evaluate`, as at run time.
The number of combinations is bounded, for one predicate and for a whole file.
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
"""Combinations of states of the resources in one predicate. A wider predicate is not checked."""
_MOST_IN_ALL = 40_000
"""Combinations in one file, so that an editor can check it at every keystroke."""

Row: TypeAlias = tuple[str, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Relation:
    """The combinations of states that satisfy a predicate. rows: the states of `names`, in this order.

    Equal predicates share one relation, so relations are compared by identity.
    """

    names: Row
    rows: frozenset[Row]


class Relations:
    """The relations of one skillset, one for each distinct predicate."""

    def __init__(self, resources: Iterable[Resource]) -> None:
        self._states = {resource.name: resource.states for resource in resources}
        self._known: dict[Expression, Relation | None] = {}
        self._left = _MOST_IN_ALL
        self.too_wide: dict[Expression, int] = {}
        """Predicates on resources that are not checked, with their numbers of combinations."""

    def of(self, expression: Expression) -> Relation | None:
        """The relation of a predicate; None if it names data or inputs, or has too many combinations."""
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
