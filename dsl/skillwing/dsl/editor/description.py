"""Descriptions of names in Markdown: declaration, meaning and comment."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

from skillwing.dsl.editor.document import Document, excerpt
from skillwing.dsl.editor.glossary import glossary_of
from skillwing.dsl.editor.names import NameScope, Symbol, SymbolKind
from skillwing.dsl.model import STALE_AFTER_PERIODS
from skillwing.dsl.reading import syntax

_LONGEST = 24  # lines of a declaration that are shown
_WIDEST = 80  # characters of a signature on one line
_ALIGNMENT = re.compile(" {2,}")


def describe(document: Document, symbol: Symbol) -> str:
    """A few lines of Markdown about a symbol that the document declares."""
    place = document.names.declarations[symbol].place
    name = document.words[document.word_at(place.start)] if place else None
    parts = [
        f"```skillset\n{_source(document, symbol)}\n```",
        document.descriptions.of(name.span if name else None),
        *_sentences(document, symbol),
    ]
    return "\n\n".join(part for part in parts if part)


# --- the source


def _source(document: Document, symbol: Symbol) -> str:
    match symbol.kind:
        case "skill":
            return _signature(document, symbol)
        case "skillset":
            return f"skillset {symbol.name}"
        case "state" | "value":
            return symbol.name
        case _:
            return _shown(excerpt(document, symbol))


def _shown(text: str) -> str:
    """A declaration without the end of a long one, and without the blanks that align a short one."""
    lines = text.splitlines()
    if len(lines) > 1:
        return "\n".join([*lines[:_LONGEST], "..."] if len(lines) > _LONGEST else lines)
    head, brace, body = text.partition("{")
    return text if '"' in text else _ALIGNMENT.sub(" ", head) + brace + _ALIGNMENT.sub("  ", body)


def _signature(document: Document, symbol: Symbol) -> str:
    """`skill goto(target: Position, speed: float64 [m/s] = 2.0) -> (stopped_at: Position)`."""
    inputs = _fields(document, NameScope("input", symbol.name))
    outputs = _fields(document, NameScope("output", symbol.name))
    answer = f" -> ({', '.join(outputs)})" if outputs else ""
    line = f"skill {symbol.name}({', '.join(inputs)}){answer}"
    if len(line) <= _WIDEST:
        return line
    lines = "".join(f"    {field},\n" for field in inputs)
    return f"skill {symbol.name}(\n{lines}){answer}"


def _fields(document: Document, scope: NameScope) -> list[str]:
    return [_shown(excerpt(document, symbol)) for symbol in document.names.names(scope)]


# --- its meaning


def _sentences(document: Document, symbol: Symbol) -> Iterator[str]:
    match document.names.declarations[symbol].node:
        case syntax.SkillsetSyntax():
            yield _counted(document)
        case syntax.DatumSyntax(period=None):
            yield "Datum of the functional layer. No period is promised, so it never counts as stale."
        case syntax.DatumSyntax(period=syntax.Number(value=period)):
            stale = STALE_AFTER_PERIODS * period
            yield f"Datum of the functional layer, published every {period:g} s, stale after {stale:g} s."
        case syntax.ResourceSyntax() as resource if symbol.kind == "state":
            yield from _state(symbol, resource)
        case syntax.SkillSyntax() as skill:
            yield from _conditions(skill)
        case _ if symbol.scope.owner:
            yield f"{symbol.kind.capitalize()} of `{symbol.scope.owner}`."
        case _:
            pass


def _counted(document: Document) -> str:
    names = document.names
    counts = [(len(names.names(NameScope(kind))), kind, plural) for kind, plural in _PLURALS]
    return ", ".join(f"{count} {kind if count == 1 else plural}" for count, kind, plural in counts if count) + "."


_PLURALS: tuple[tuple[SymbolKind, str], ...] = (
    ("type", "types"),
    ("datum", "data"),
    ("resource", "resources"),
    ("event", "events"),
    ("skill", "skills"),
)


def _state(symbol: Symbol, resource: syntax.ResourceSyntax) -> Iterator[str]:
    """The transitions to and from the state."""
    edges = [item for item in resource.items if isinstance(item, syntax.TransitionSyntax)]
    initial = any(isinstance(item, syntax.InitialSyntax) and item.state.text == symbol.name for item in resource.items)
    yield f"{'Initial state' if initial else 'State'} of the resource `{symbol.scope.owner}`."
    for words, near, far in (("Entered", "target", "source"), ("Left", "source", "target")):
        pairs = [(getattr(edge, near).text, getattr(edge, far).text, edge.extern) for edge in edges]
        ways = [
            f"{'any other' if there == '*' else f'`{there}`'}{' (extern)' if extern else ''}"
            for here, there, extern in pairs
            if here == symbol.name or (here == "*" and there != symbol.name)
        ]
        if ways:
            yield f"{words} {'from' if words == 'Entered' else 'for'} {', '.join(ways)}."


def _conditions(skill: syntax.SkillSyntax) -> Iterator[str]:
    """The preconditions and the ends of the skill."""
    for section in skill.sections:
        match section:
            case syntax.PreconditionSection(checks=checks) if checks:
                yield f"Needs {', '.join(f'`{check.name.text}`' for check in checks)}."
            case syntax.ResultSection(results=results) if results:
                yield f"Ends {', '.join(f'`{result.name.text}`{_partition(result)}' for result in results)}."
            case _:
                pass


def _partition(result: syntax.ResultSyntax) -> str:
    return f" ({result.partition})" if result.partition else ""


@dataclass(frozen=True, slots=True)
class Hover:
    """Markdown about the words between two offsets."""

    markdown: str
    start: int
    end: int


def hover(document: Document, offset: int) -> Hover | None:
    """The description of the name or keyword at an offset; None if there is none."""
    occurrence = document.names.at(offset)
    if occurrence is not None:
        if occurrence.symbol is None:
            return None
        return Hover(describe(document, occurrence.symbol), occurrence.start, occurrence.end)
    for position in (document.word_at(offset), document.word_at(offset - 1)):
        word = document.words[position] if position >= 0 else None
        if word is None or not word.start <= offset <= word.end:
            continue
        text = glossary_of(document.file).meaning(word.text, document.assigned(position))
        if text is not None:
            return Hover(text, word.start, word.end)
    return None
