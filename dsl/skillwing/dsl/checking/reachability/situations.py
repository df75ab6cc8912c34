"""Sets of situations: combinations of states of the resources, stored as a product of independent factors.

Independent resources have factors of their own: twelve resources of six states take 72 entries and not 6^12. A
predicate on several resources relates them: their factors are joined, exactly.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from itertools import chain, product
from math import prod
from typing import TypeAlias

from skillwing.dsl.checking.reachability.relations import Relation, Row

_MOST_ROWS = 4096  # of one factor; a predicate that would need more leaves the set as it is

Changes: TypeAlias = tuple[tuple[str, str, frozenset[str]], ...]
"""An effect: (resource, target, source states) of each of its transitions."""


class _Factor:
    """Some resources and their possible combinations of states. rows: in the order of `names`."""

    __slots__ = ("names", "rows")

    def __init__(self, names: Row, rows: frozenset[Row]) -> None:
        self.names = names
        self.rows = rows

    def states(self, name: str) -> frozenset[str]:
        column = self.names.index(name)
        return frozenset([row[column] for row in self.rows])

    def without(self, name: str) -> _Factor:
        column = self.names.index(name)
        rows = frozenset(row[:column] + row[column + 1 :] for row in self.rows)
        return _Factor(self.names[:column] + self.names[column + 1 :], rows)


class Situations:
    """An immutable set of situations. All methods return new sets.

    loose: a predicate was left out because it would relate too many resources. The set is then too large, never too
    small.
    """

    __slots__ = ("_factors", "empty", "loose")

    def __init__(self, factors: dict[str, _Factor], empty: bool, loose: bool = False) -> None:
        self._factors = factors
        self.empty = empty
        self.loose = loose

    @classmethod
    def independent(cls, states: Mapping[str, Collection[str]]) -> Situations:
        """Every combination of these states of each resource."""
        return cls({name: _single(name, some) for name, some in states.items()}, empty=not all(states.values()))

    @classmethod
    def enumerated(cls, names: Row, rows: Iterable[Row]) -> Situations:
        """Exactly these combinations."""
        factor = _Factor(names, frozenset(rows))
        return cls(dict.fromkeys(names, factor), empty=not factor.rows)

    @classmethod
    def side_by_side(cls, parts: Iterable[Situations]) -> Situations:
        """Every combination of a situation of each part. The parts have no resource in common."""
        listed = list(parts)
        factors = {name: factor for part in listed for name, factor in part._factors.items()}
        return cls(factors, any(part.empty for part in listed), any(part.loose for part in listed))

    def states(self, name: str) -> frozenset[str]:
        """The states that a resource has in any of the situations."""
        return frozenset() if self.empty else self._factors[name].states(name)

    def example(self, names: Iterable[str]) -> dict[str, str]:
        """The states of some resources in one of the situations, always the same one."""
        picked = {factor.names: min(factor.rows) for factor in self._factors.values()}
        found = {name: state for key, row in picked.items() for name, state in zip(key, row, strict=True)}
        return {name: found[name] for name in names}

    # --- narrowing

    def where(self, relation: Relation, wanted: bool = True) -> Situations:
        """The situations in which the relation holds, or in which it does not."""
        touched = list(dict.fromkeys([self._factors[name] for name in relation.names]))
        if len(touched) == 1 and touched[0].names == relation.names:
            before = touched[0].rows
            rows = before & relation.rows if wanted else before - relation.rows
            return self if len(rows) == len(before) else self._with(_Factor(relation.names, rows))
        if prod(len(factor.rows) for factor in touched) > _MOST_ROWS:
            return Situations(self._factors, self.empty, loose=True)
        names = tuple(chain.from_iterable(factor.names for factor in touched))
        columns = [names.index(name) for name in relation.names]
        joined = map(_concatenated, product(*(factor.rows for factor in touched)))
        kept = frozenset(row for row in joined if (tuple([row[at] for at in columns]) in relation.rows) is wanted)
        return self._with(_Factor(names, kept))

    def where_all(self, relations: Iterable[Relation]) -> Situations:
        narrowed = self
        for relation in relations:
            narrowed = narrowed.where(relation)
        return narrowed

    # --- effects

    def able(self, changes: Changes) -> Situations:
        """The situations in which every transition of the effect can be taken."""
        able = self
        for name, _, sources in changes:
            able = able._where_in(name, sources, wanted=True)
        return able

    def unable(self, changes: Changes) -> Situations:
        """The situations in which some transition of the effect cannot be taken."""
        return either([self._where_in(name, sources, wanted=False) for name, _, sources in changes], self)

    def _where_in(self, name: str, states: frozenset[str], wanted: bool) -> Situations:
        factor = self._factors[name]
        column = factor.names.index(name)
        rows = frozenset([row for row in factor.rows if (row[column] in states) is wanted])
        return self if len(rows) == len(factor.rows) else self._with(_Factor(factor.names, rows))

    def after(self, changes: Changes) -> Situations:
        """The situations after the effect, from those in which it can be applied."""
        moved = self.able(changes)
        for name, target, _ in changes:
            moved = moved.freed(name, (target,))
        return moved

    def freed(self, name: str, states: Iterable[str]) -> Situations:
        """The same set with one resource in any of these states."""
        if self.empty:
            return self
        factor = self._factors[name]
        alone = _single(name, states)
        if len(factor.names) == 1:
            return self._with(alone)
        return self._with(alone, factor.without(name))

    def _with(self, *factors: _Factor) -> Situations:
        changed = self._factors.copy()
        empty = self.empty
        for factor in factors:
            empty = empty or not factor.rows
            for name in factor.names:
                changed[name] = factor
        return Situations(changed, empty, self.loose)

    # --- union

    def union(self, other: Situations) -> Situations:
        """All situations of both sets, and combinations of the two if they differ in several factors."""
        if self.empty or other.empty:
            return other if self.empty else self
        merged: dict[str, _Factor] = {}
        for name, factor in self._factors.items():
            if name in merged:
                continue
            counterpart = other._factors[name]
            if factor.names == counterpart.names:
                merged |= dict.fromkeys(factor.names, _Factor(factor.names, factor.rows | counterpart.rows))
            else:
                merged[name] = _single(name, factor.states(name) | counterpart.states(name))
        return Situations(merged, False, self.loose or other.loose)


def either(alternatives: Iterable[Situations], like: Situations) -> Situations:
    """The union of several sets. For no set, the empty set over the resources of `like`."""
    united = like.where(Relation((), frozenset()))
    for alternative in alternatives:
        united = united.union(alternative)
    return united


def _single(name: str, states: Iterable[str]) -> _Factor:
    return _Factor((name,), frozenset([(state,) for state in states]))


def _concatenated(parts: tuple[Row, ...]) -> Row:
    return parts[0] if len(parts) == 1 else tuple(chain.from_iterable(parts))
