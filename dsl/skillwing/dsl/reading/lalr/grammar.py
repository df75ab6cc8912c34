"""An analysed grammar: its terminals, its rules and its LALR tables, as plain data. It can be stored as JSON."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from sys import intern
from typing import Any

END = "$END"


@dataclass(frozen=True, slots=True)
class TerminalSymbol:
    """A terminal. text: its only text; None if `expression`, a regular expression, matches several."""

    name: str
    text: str | None
    expression: str


@dataclass(frozen=True, slots=True)
class Rule:
    """A rule by which `origin` becomes a sequence of symbols, in Lark's conventions.

    name: of the method that builds its node. symbols: their number. inlined: by the index of a symbol, the name of a
    rule whose children become children of this one. dropped: indices of terminals that are no children. gaps: number
    of absent options before each symbol, and behind the last.
    """

    origin: str
    name: str
    symbols: int
    inlined: Mapping[int, str]
    dropped: Sequence[int]
    gaps: Sequence[int]


@dataclass(frozen=True, slots=True)
class Grammar:
    """LALR tables. States are counted from 0, where a text begins.

    terminals: the first that matches counts. next_states: in each state, by symbol. reductions: in each state, by the
    terminal that follows, the index of the rule. The state behind the whole text is the next one by END.
    """

    terminals: Sequence[TerminalSymbol]
    rules: Sequence[Rule]
    next_states: Sequence[Mapping[str, int]]
    reductions: Sequence[Mapping[str, int]]


def to_json(grammar: Grammar, digest: str) -> str:
    """A grammar as JSON. digest: of the source that was analysed."""
    stored = asdict(grammar)
    lines = [f'"digest": {json.dumps(digest)}']
    for part in ("terminals", "rules", "next_states", "reductions"):
        rows = ",\n".join(json.dumps(row, ensure_ascii=False) for row in stored[part])
        lines.append(f'"{part}": [\n{rows}\n]')
    return "{\n" + ",\n".join(lines) + "\n}\n"


def from_json(text: str, digest: str) -> Grammar | None:
    """The grammar of that text; None for another text, or if its source was another one.

    digest: of the source as it is now.
    """
    try:
        stored: dict[str, Any] = json.loads(text)
        if stored["digest"] != digest:
            return None
        return Grammar(
            terminals=[TerminalSymbol(**row) for row in stored["terminals"]],
            rules=[_rule(row) for row in stored["rules"]],
            next_states=[_interned(row) for row in stored["next_states"]],
            reductions=[_interned(row) for row in stored["reductions"]],
        )
    except (ValueError, KeyError, TypeError):  # of another version, or with the marks of a merge
        return None


def _rule(row: dict[str, Any]) -> Rule:
    row["origin"] = intern(row["origin"])
    row["inlined"] = {int(index): name for index, name in row["inlined"].items()}
    return Rule(**row)


def _interned(row: Mapping[str, int]) -> dict[str, int]:
    """Symbols are compared for each word of a text."""
    return {intern(symbol): number for symbol, number in row.items()}
