"""The analysis of a grammar by Lark."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, cast

from lark import Lark
from lark.grammar import Rule as LarkRule
from lark.grammar import Symbol
from lark.lexer import PatternStr, TerminalDef
from lark.parsers.lalr_analysis import Shift

from skillwing.dsl.reading.lalr.grammar import END, Grammar, Rule, TerminalSymbol

WHITE_SPACE = "WHITE_SPACE"

_Row = Mapping[str, tuple[object, Any]]


def analyse(grammar: str, folder: str, start: str) -> Grammar:
    """Analyse a grammar in Lark's notation.

    folder: of the grammars that it imports. start: its start rule. A rule `_unreadable`, which no other uses, holds the
    terminals that no rule accepts.
    """
    lark = Lark(
        grammar,
        source_path=f"{folder}/grammar.lark",
        parser="lalr",
        lexer="basic",
        start=[start, "_unreadable"],
        maybe_placeholders=True,
    )
    conf = cast(Any, lark).parse_interactive("", start=start).parser_state.parse_conf
    rows = cast("Mapping[int, _Row]", conf.parse_table.states)
    states = _in_order(rows, conf.start_state)
    number = {state: index for index, state in enumerate(states)}
    found = {argument for state in states for action, argument in rows[state].values() if action is not Shift}
    rules = sorted(cast("set[LarkRule]", found), key=lambda rule: (str(rule.origin.name), rule.order))
    index = {rule: at for at, rule in enumerate(rules)}
    next_states: list[dict[str, int]] = []
    reductions: list[dict[str, int]] = []
    for state in states:
        row = sorted(rows[state].items())
        next_states.append({str(symbol): number[to] for symbol, (action, to) in row if action is Shift})
        reductions.append({str(symbol): index[rule] for symbol, (action, rule) in row if action is not Shift})
    next_states[number[conf.end_state]][END] = number[conf.end_state]
    terminals = [_terminal(each) for each in _by_precedence(cast("list[TerminalDef]", lark.terminals))]
    return Grammar(terminals, [_rule(rule) for rule in rules], next_states, reductions)


def _in_order(rows: Mapping[int, _Row], start: int) -> list[int]:
    """All states that can be reached from the first one. The order depends on the grammar alone."""
    states = [start]
    seen = {start}
    for state in states:
        for _, (action, to) in sorted(rows[state].items(), key=lambda item: str(item[0])):
            if action is Shift and to not in seen:
                seen.add(to)
                states.append(to)
    return states


def _by_precedence(terminals: list[TerminalDef]) -> list[TerminalDef]:
    """Terminals as Lark prefers them: those of higher priority first, then those that can be longest."""
    return sorted(
        (terminal for terminal in terminals if terminal.name != WHITE_SPACE),
        key=lambda terminal: (
            -terminal.priority,
            -terminal.pattern.max_width,
            -len(terminal.pattern.value),
            terminal.name,
        ),
    )


def _terminal(terminal: TerminalDef) -> TerminalSymbol:
    pattern = terminal.pattern
    text = pattern.value if isinstance(pattern, PatternStr) else None
    return TerminalSymbol(str(terminal.name), text, pattern.to_regexp())


def _rule(rule: LarkRule) -> Rule:
    symbols = list(enumerate(rule.expansion))
    return Rule(
        origin=str(rule.origin.name),
        name=str(rule.alias or rule.origin.name),
        symbols=len(symbols),
        inlined={index: str(symbol.name) for index, symbol in symbols if _is_inlined(symbol)},
        dropped=[index for index, symbol in symbols if _is_dropped(symbol)],
        gaps=_gaps(rule),
    )


def _is_inlined(symbol: Symbol) -> bool:
    return not symbol.is_term and symbol.name.startswith("_")


def _is_dropped(symbol: Symbol) -> bool:
    return symbol.is_term and bool(cast(Any, symbol).filter_out)


def _gaps(rule: LarkRule) -> list[int]:
    """The number of absent options before each symbol of the rule, and behind the last."""
    marks = rule.options.empty_indices or [False] * len(rule.expansion)
    gaps = [0]
    for absent in marks:
        if absent:
            gaps[-1] += 1
        else:
            gaps.append(0)
    return gaps
