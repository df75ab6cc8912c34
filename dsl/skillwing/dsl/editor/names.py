"""The names of a skillset file: their declarations and uses."""

from __future__ import annotations

from bisect import bisect_left
from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Literal as OneOf
from typing import TypeAlias

SymbolKind: TypeAlias = OneOf[
    "skillset",
    "type",
    "datum",
    "resource",
    "event",
    "skill",
    "field",
    "value",
    "state",
    "input",
    "output",
    "feedback",
    "effect",
    "precondition",
    "invariant",
    "result",
]

# Kinds of the owners of names; the owner of all others is the skillset.
_OWNERS: Mapping[SymbolKind, SymbolKind] = {
    "field": "type",
    "value": "type",
    "state": "resource",
    "input": "skill",
    "output": "skill",
    "feedback": "skill",
    "effect": "skill",
    "precondition": "skill",
    "invariant": "skill",
    "result": "skill",
}


@dataclass(frozen=True, slots=True)
class NameScope:
    """A set of names that must be unique: the resources of the skillset, the states of one resource, ...

    owner: the type, resource or skill that the names belong to; empty for those of the whole skillset.
    """

    kind: SymbolKind
    owner: str = ""


@dataclass(frozen=True, slots=True)
class Symbol:
    """The element that a name refers to."""

    scope: NameScope
    name: str

    @property
    def kind(self) -> SymbolKind:
        return self.scope.kind

    @property
    def title(self) -> str:
        """Description: "state `OK` of `camera`"."""
        owner = f" of `{self.scope.owner}`" if self.scope.owner else ""
        return f"{self.kind} `{self.name}`{owner}"

    @property
    def owner(self) -> Symbol | None:
        """The type, resource or skill that this belongs to; None for elements of the skillset."""
        kind = _OWNERS.get(self.kind)
        return None if kind is None else Symbol(NameScope(kind), self.scope.owner)

    def after_renaming(self, renamed: Symbol, name: str) -> Symbol:
        """Symbol after a renaming of `renamed` to `name`: changed if it is that symbol or belongs to it."""
        if self == renamed:
            return replace(self, name=name)
        if self.owner == renamed:
            return replace(self, scope=replace(self.scope, owner=name))
        return self


@dataclass(frozen=True, slots=True)
class Occurrence:
    """A name in the text, from offset `start` up to, and without, `end`.

    scopes: the scopes of its look-up, in this order. symbol: its meaning, None if it is not declared. declares, uses:
    its roles; the first mention of a state has both if there is no list of states.
    """

    name: str
    start: int
    end: int
    scopes: tuple[NameScope, ...]
    symbol: Symbol | None
    declares: bool
    uses: bool


@dataclass(frozen=True, slots=True)
class Declaration:
    """A declaration. node: its syntax node. place: the occurrence of its name, None if it is not in the text."""

    node: object
    place: Occurrence | None


class Index:
    """All names of one text. occurrences: in the order of the text."""

    def __init__(self, declarations: Mapping[Symbol, Declaration], occurrences: Iterable[Occurrence]) -> None:
        self.declarations = declarations
        self.occurrences = tuple(sorted(occurrences, key=lambda occurrence: occurrence.start))
        self._ends = [occurrence.end for occurrence in self.occurrences]
        self._by_symbol: dict[Symbol | None, list[Occurrence]] = defaultdict(list)
        for occurrence in self.occurrences:
            self._by_symbol[occurrence.symbol].append(occurrence)
        self._by_scope: dict[NameScope, list[Symbol]] = defaultdict(list)
        for symbol in declarations:
            self._by_scope[symbol.scope].append(symbol)

    def at(self, offset: int) -> Occurrence | None:
        """The name around the offset or right before it."""
        candidates = self.occurrences[bisect_left(self._ends, offset) :][:2]
        touching = [candidate for candidate in candidates if candidate.start <= offset]
        return touching[-1] if touching else None

    def of(self, symbol: Symbol) -> tuple[Occurrence, ...]:
        """All declarations and uses of the symbol."""
        return tuple(self._by_symbol.get(symbol, ()))

    def names(self, scope: NameScope) -> tuple[Symbol, ...]:
        """The symbols that a scope declares, in their order."""
        return tuple(self._by_scope.get(scope, ()))
