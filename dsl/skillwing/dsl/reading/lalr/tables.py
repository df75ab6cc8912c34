"""The LALR tables of a grammar, made by Lark, with the function that builds the node of each rule.

Lark's conventions hold. Terminals without a name, and those that start with `_`, are left out of a node's children.
Rules that start with `_` give their children to the rule above. An absent `[option]` is None.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from operator import itemgetter
from sys import intern
from typing import Any, TypeAlias, cast

from lark import Lark
from lark.grammar import Rule, Symbol
from lark.parsers.lalr_analysis import Shift

END = "$END"

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

    gotos: in each state, by the symbol of a reduced rule, the next state. start: first state.
    """

    actions: Mapping[int, Mapping[str, int | Reduction]]
    gotos: Mapping[int, Mapping[str, int]]
    start: int


def tables(lark: Lark, start: str, builder: object) -> Tables:
    """Join Lark's tables with the builder. Its method with the name or alias of a rule builds the rule's node."""
    conf = cast(Any, lark).parse_interactive("", start=start).parser_state.parse_conf
    rows = cast("Mapping[int, Mapping[str, tuple[object, Any]]]", conf.parse_table.states)
    rules = {argument for row in rows.values() for action, argument in row.values() if action is not Shift}
    reductions = _reductions(cast("set[Rule]", rules), builder)
    actions: dict[int, dict[str, int | Reduction]] = {}
    gotos: dict[int, dict[str, int]] = {}
    for state, row in rows.items():
        actions[state], gotos[state] = {}, {}
        for token, (action, argument) in row.items():
            symbol = intern(str(token))  # Lark's are slow to compare.
            if action is not Shift:
                actions[state][symbol] = reductions[argument]
            elif symbol.isupper():
                actions[state][symbol] = argument
            else:
                gotos[state][symbol] = argument
    actions[conf.end_state][END] = conf.end_state
    return Tables(actions, gotos, conf.start_state)


def _reductions(rules: Iterable[Rule], builder: object) -> dict[Rule, Reduction]:
    single = _single(rules)
    return {
        rule: Reduction(len(rule.expansion), _build(rule, single, builder), intern(str(rule.origin.name)))
        for rule in rules
    }


# --- what a rule makes of its values


def _is_inlined(symbol: Symbol) -> bool:
    return not symbol.is_term and symbol.name.startswith("_")


def _is_dropped(symbol: Symbol) -> bool:
    return symbol.is_term and bool(cast(Any, symbol).filter_out)


def _single(rules: Iterable[Rule]) -> frozenset[str]:
    """The inlined rules that always have exactly one child. Their value is the child, not a list of children."""
    by_name: dict[str, list[Rule]] = defaultdict(list)
    for rule in rules:
        if _is_inlined(rule.origin):
            by_name[rule.origin.name].append(rule)
    single = set(by_name)

    def has_one_child(rule: Rule) -> bool:
        kept = [symbol for symbol in rule.expansion if not _is_dropped(symbol)]
        return len(kept) == 1 and (not _is_inlined(kept[0]) or kept[0].name in single) and not any(_gaps(rule))

    while refuted := {name for name in single if not all(map(has_one_child, by_name[name]))}:
        single -= refuted
    return frozenset(single)


def _gaps(rule: Rule) -> list[int]:
    """The number of absent options before each symbol of the rule, and behind the last."""
    marks = rule.options.empty_indices or [False] * len(rule.expansion)
    gaps = [0]
    for absent in marks:
        if absent:
            gaps[-1] += 1
        else:
            gaps.append(0)
    return gaps


def _build(rule: Rule, single: frozenset[str], builder: object) -> Build | None:
    symbols = list(enumerate(rule.expansion))
    kept = [index for index, symbol in symbols if not _is_dropped(symbol)]
    spliced = {index for index, symbol in symbols if _is_inlined(symbol) and symbol.name not in single}
    if rule.origin.name in single:
        return None if len(symbols) == 1 else _the_one(kept[0])
    if _is_inlined(rule.origin):
        return _collecting(kept, spliced)
    method = cast("Callable[..., object]", getattr(builder, rule.alias or rule.origin.name))
    gaps = _gaps(rule)
    if not any(gaps) and not spliced:
        return method if len(kept) == len(symbols) else _from_some(method, kept)
    return _from_lists(method, kept, spliced, gaps)


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


def _from_lists(method: Callable[..., object], kept: list[int], spliced: set[int], gaps: list[int]) -> Build:
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
