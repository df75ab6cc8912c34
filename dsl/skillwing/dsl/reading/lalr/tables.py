"""The LALR tables of a grammar, with the function that builds the node of each rule.

Lark's conventions hold. Terminals without a name, and those that start with `_`, are left out of a node's children.
Rules that start with `_` give their children to the rule above. An absent `[option]` is None.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from operator import itemgetter
from typing import Any, TypeAlias, cast

from skillwing.dsl.reading.lalr.grammar import Grammar, Rule

Build: TypeAlias = Callable[..., object]


@dataclass(frozen=True, slots=True, eq=False)
class Reduction:
    """The reduction of a complete rule: its length, its builder, and its symbol.

    build: called with the values of the rule's symbols; None for a rule of one symbol, whose value stays as it is.
    """

    size: int
    build: Build | None
    origin: str


@dataclass(frozen=True, slots=True)
class Tables:
    """LALR tables. actions: in each state, by terminal, the next state or the reduction to make first.

    gotos: in each state, by the symbol of a reduced rule, the next state. A text begins in state 0.
    """

    actions: Sequence[Mapping[str, int | Reduction]]
    gotos: Sequence[Mapping[str, int]]


def tables(grammar: Grammar, builder: object) -> Tables:
    """Join a grammar with the builder. Its method with the name of a rule builds the rule's node."""
    single = _single(grammar.rules)
    reductions = [Reduction(rule.symbols, _build(rule, single, builder), rule.origin) for rule in grammar.rules]
    actions: list[dict[str, int | Reduction]] = []
    gotos: list[dict[str, int]] = []
    for shifts, row in zip(grammar.next_states, grammar.reductions, strict=True):
        actions.append({symbol: reductions[rule] for symbol, rule in row.items()})
        gotos.append({symbol: state for symbol, state in shifts.items() if not _is_terminal(symbol)})
        actions[-1].update((symbol, state) for symbol, state in shifts.items() if _is_terminal(symbol))
    return Tables(actions, gotos)


def _is_terminal(symbol: str) -> bool:
    return symbol.isupper()


# --- what a rule makes of its values


def _is_inlined(rule: Rule) -> bool:
    return rule.origin.startswith("_")


def _kept(rule: Rule) -> list[int]:
    """Indices of the symbols that are children."""
    return [index for index in range(rule.symbols) if index not in rule.dropped]


def _single(rules: Iterable[Rule]) -> frozenset[str]:
    """The inlined rules that always have exactly one child. Their value is the child, not a list of children."""
    by_name: dict[str, list[Rule]] = defaultdict(list)
    for rule in rules:
        if _is_inlined(rule):
            by_name[rule.origin].append(rule)
    single = set(by_name)

    def has_one_child(rule: Rule) -> bool:
        kept = _kept(rule)
        return len(kept) == 1 and rule.inlined.get(kept[0]) in {None, *single} and not any(rule.gaps)

    while refuted := {name for name in single if not all(map(has_one_child, by_name[name]))}:
        single -= refuted
    return frozenset(single)


def _build(rule: Rule, single: frozenset[str], builder: object) -> Build | None:
    kept = _kept(rule)
    spliced = {index for index, name in rule.inlined.items() if name not in single}
    if rule.origin in single:
        return None if rule.symbols == 1 else _the_one(kept[0])
    if _is_inlined(rule):
        return _collecting(kept, spliced)
    method = cast("Callable[..., object]", getattr(builder, rule.name))
    if not any(rule.gaps) and not spliced:
        return method if len(kept) == rule.symbols else _from_some(method, kept)
    return _from_lists(method, kept, spliced, rule.gaps)


def _the_one(index: int) -> Build:
    return lambda *values: values[index]


def _from_some(method: Callable[..., object], kept: list[int]) -> Build:
    if len(kept) == 1:
        index = kept[0]
        return lambda *values: method(values[index])
    if not kept:
        return lambda *_: method()
    pick = cast("Callable[[object], tuple[object, ...]]", itemgetter(*kept))
    return lambda *values: method(*pick(values))


def _from_lists(method: Callable[..., object], kept: list[int], spliced: set[int], gaps: Sequence[int]) -> Build:
    # A list of slots: None for an absent option, else the index of a value and whether it is a list of children.
    slots: list[tuple[int, bool] | None] = []
    for index, absent in enumerate(gaps):
        slots += [None] * absent
        if index in kept:
            slots.append((index, index in spliced))

    def build(*values: Any) -> object:
        children: list[object] = []
        for slot in slots:
            if slot is None:
                children.append(None)
            elif slot[1]:
                children += values[slot[0]]
            else:
                children.append(values[slot[0]])
        return method(*children)

    return build


def _collecting(kept: list[int], spliced: set[int]) -> Build:
    """Collect children in a list. A list that comes first is extended, so that long repetitions take linear time."""
    first, others = (kept[0], kept[1:]) if kept and kept[0] in spliced else (None, kept)

    def build(*values: Any) -> object:
        children: list[object] = [] if first is None else values[first]
        for index in others:
            if index in spliced:
                children += values[index]
            else:
                children.append(values[index])
        return children

    return build
