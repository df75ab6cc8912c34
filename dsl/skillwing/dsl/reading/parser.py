"""From source text to syntax nodes, with every syntax problem of the file.

Lark supplies the lexer and the LALR tables (`skillset.lark`); `recovery.py` drives them across mistakes.
"""

from __future__ import annotations

import threading
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any, TypeVar, cast

from lark import Lark, Token

from skillwing.dsl.diagnostics.diagnostic import Diagnostic
from skillwing.dsl.expressions import And, Comparison, Expression, Implies, Literal, Name, Not, Operator, Or, Symbol
from skillwing.dsl.reading import syntax
from skillwing.dsl.reading.recovery import ParserState, Recovery
from skillwing.dsl.reading.syntax import Word
from skillwing.dsl.spans import Span

_T = TypeVar("_T")
_Children = list[object]


@dataclass(frozen=True, slots=True)
class ParsedFile:
    """What could be read of a file. root: None where nothing could. diagnostics: its syntax errors.

    elements_lost: some element could not be read at all, so that a name that seems unknown may stand in it.
    """

    root: syntax.SkillsetSyntax | None
    diagnostics: tuple[Diagnostic, ...]
    elements_lost: bool


def parse_file(text: str, file: str) -> ParsedFile:
    """Parse a whole file; never raises for what the text may contain."""
    lark, builder, lock = _machinery()
    with lock:
        builder.file = file
        interactive = cast(Any, lark).parse_interactive(text, start="skillset")
        state = cast(ParserState, interactive.parser_state)
        tokens = cast("list[Token]", list(interactive.lexer_thread.lex(state)))
        recovery = Recovery(state, tokens, file)
        root = recovery.run()
    return ParsedFile(
        root if isinstance(root, syntax.SkillsetSyntax) else None,
        tuple(recovery.diagnostics),
        recovery.elements_lost,
    )


@cache
def _machinery() -> tuple[Lark, _Builder, threading.Lock]:
    """The tables and the builder they call. Lark ties the two together once, hence the lock around their use."""
    builder = _Builder()
    grammar = files("skillwing.dsl.reading").joinpath("skillset.lark").read_text(encoding="utf-8")
    lark = Lark(
        grammar,
        parser="lalr",
        lexer="basic",
        start=["skillset", "unreadable"],
        transformer=builder,
        maybe_placeholders=True,
    )
    return lark, builder, threading.Lock()


class _Builder:
    """Lark calls the method named after each rule as soon as the rule is complete."""

    file: str = ""

    # --- words

    def _span(self, token: Token) -> Span:
        line, column = token.line or 1, token.column or 1
        return Span(self.file, line, column, token.end_line or line, token.end_column or column)

    def _word(self, token: object) -> Word:
        assert isinstance(token, Token)
        return Word(str(token), self._span(token))

    def _words(self, tokens: Iterable[object]) -> tuple[Word, ...]:
        return tuple(self._word(token) for token in tokens if isinstance(token, Token))

    def _optional(self, token: object) -> Word | None:
        return None if token is None else self._word(token)

    def _number(self, token: object) -> syntax.Number:
        assert isinstance(token, Token)
        return syntax.Number(_numeric(token), self._span(token))

    # --- the whole

    def skillset(self, children: _Children) -> syntax.SkillsetSyntax:
        return syntax.SkillsetSyntax(
            self._word(children[0]), cast("tuple[syntax.Element, ...]", _present(children[1:]))
        )

    def broken(self, _children: _Children) -> None:
        return None

    # --- types and data

    def data(self, children: _Children) -> syntax.DataSyntax:
        return syntax.DataSyntax(_only(children, syntax.DatumSyntax))

    def datum(self, children: _Children) -> syntax.DatumSyntax:
        name, type_use, unit, period = children
        assert isinstance(type_use, syntax.TypeUse)
        promised = None if period is None else self._number(period)
        return syntax.DatumSyntax(self._word(name), type_use, self._optional(unit), promised)

    def enum(self, children: _Children) -> syntax.EnumSyntax:
        name, *values = self._words(children)
        return syntax.EnumSyntax(name, tuple(values))

    def struct(self, children: _Children) -> syntax.StructSyntax:
        return syntax.StructSyntax(self._word(children[0]), _only(children, syntax.FieldSyntax))

    def field(self, children: _Children) -> syntax.FieldSyntax:
        name, type_use, unit, bounds, default = children
        assert isinstance(type_use, syntax.TypeUse)
        return syntax.FieldSyntax(
            self._word(name),
            type_use,
            self._optional(unit),
            cast("syntax.BoundsSyntax | None", bounds),
            cast("Literal | Symbol | None", default),
        )

    def type(self, children: _Children) -> syntax.TypeUse:
        name, *arrays = self._words(children)
        return syntax.TypeUse(name, tuple(arrays))

    def bounds(self, children: _Children) -> syntax.BoundsSyntax:
        low, high = children
        return syntax.BoundsSyntax(self._number(low), self._number(high))

    def default(self, children: _Children) -> object:
        return children[0]

    def symbol(self, children: _Children) -> Symbol:
        word = self._word(children[0])
        return Symbol(word.text, word.span)

    # --- resources and events

    def resource(self, children: _Children) -> syntax.ResourceSyntax:
        name, *items = children
        return syntax.ResourceSyntax(
            self._word(name),
            cast("tuple[syntax.StatesSyntax | syntax.InitialSyntax | syntax.TransitionSyntax, ...]", _present(items)),
        )

    def states(self, children: _Children) -> syntax.StatesSyntax:
        return syntax.StatesSyntax(self._words(children))

    def initial(self, children: _Children) -> syntax.InitialSyntax:
        return syntax.InitialSyntax(self._word(children[0]))

    def transition(self, children: _Children) -> syntax.TransitionSyntax:
        extern, source, target = children
        return syntax.TransitionSyntax(self._word(source), self._word(target), extern is not None)

    def event(self, children: _Children) -> syntax.EventSyntax:
        name, *items = children
        return syntax.EventSyntax(
            self._word(name), cast("tuple[syntax.GuardSyntax | syntax.EventEffectSyntax, ...]", _present(items))
        )

    def guard(self, children: _Children) -> syntax.GuardSyntax:
        return syntax.GuardSyntax(_one(children, syntax.PredicateSyntax))

    def event_effect(self, children: _Children) -> syntax.EventEffectSyntax:
        return syntax.EventEffectSyntax(_only(children, syntax.ChangeSyntax))

    # --- skills

    def skill(self, children: _Children) -> syntax.SkillSyntax:
        return syntax.SkillSyntax(self._word(children[0]), cast("tuple[syntax.Section, ...]", _present(children[1:])))

    def progress(self, children: _Children) -> syntax.ProgressSection:
        keyword, period = children[:2]
        return syntax.ProgressSection(self._word(keyword), self._number(period), _only(children, syntax.FieldSyntax))

    def deadline(self, children: _Children) -> syntax.LimitSection:
        keyword, seconds = children
        return syntax.LimitSection(self._word(keyword), self._number(seconds))

    dispatch_timeout = deadline

    def input(self, children: _Children) -> syntax.FieldsSection:
        return syntax.FieldsSection(self._word(children[0]), _only(children, syntax.FieldSyntax))

    output = input

    def effects(self, children: _Children) -> syntax.EffectSection:
        return syntax.EffectSection(self._word(children[0]), _only(children, syntax.EffectSyntax))

    def single_effect(self, children: _Children) -> syntax.EffectSyntax:
        return syntax.EffectSyntax(self._word(children[0]), _only(children, syntax.ChangeSyntax))

    block_effect = single_effect

    def change(self, children: _Children) -> syntax.ChangeSyntax:
        resource, target = children
        return syntax.ChangeSyntax(self._word(resource), self._word(target))

    def preconditions(self, children: _Children) -> syntax.PreconditionSection:
        effects = _only(children, _StartEffect)
        return syntax.PreconditionSection(
            self._word(children[0]),
            _only(children, syntax.CheckSyntax),
            tuple(effect.name for effect in effects if effect.on_success),
            tuple(effect.name for effect in effects if not effect.on_success),
        )

    def check(self, children: _Children) -> syntax.CheckSyntax:
        return syntax.CheckSyntax(self._word(children[0]), _one(children, syntax.PredicateSyntax))

    def on_success(self, children: _Children) -> _StartEffect:
        return _StartEffect(self._word(children[0]), on_success=True)

    def on_failure(self, children: _Children) -> _StartEffect:
        return _StartEffect(self._word(children[0]), on_success=False)

    def invariants(self, children: _Children) -> syntax.InvariantSection:
        return syntax.InvariantSection(self._word(children[0]), _only(children, syntax.InvariantSyntax))

    def invariant(self, children: _Children) -> syntax.InvariantSyntax:
        name, predicate, violation = children
        assert isinstance(predicate, syntax.PredicateSyntax)
        return syntax.InvariantSyntax(self._word(name), predicate, self._optional(violation))

    def results(self, children: _Children) -> syntax.ResultSection:
        return syntax.ResultSection(self._word(children[0]), _only(children, syntax.ResultSyntax))

    def result(self, children: _Children) -> syntax.ResultSyntax:
        partition, name, apply, post = children
        return syntax.ResultSyntax(
            self._word(name),
            cast("str | None", partition),
            cast("syntax.ApplySyntax | None", apply),
            cast("syntax.PredicateSyntax | None", post),
        )

    def partition(self, children: _Children) -> str:
        return str(children[0])

    def apply(self, children: _Children) -> syntax.ApplySyntax:
        return syntax.ApplySyntax(self._word(children[0]))

    def post(self, children: _Children) -> syntax.PredicateSyntax:
        return _one(children, syntax.PredicateSyntax)

    def timeout(self, children: _Children) -> syntax.Number:
        return self._number(children[0])

    def interrupt(self, children: _Children) -> syntax.EndSection:
        return syntax.EndSection(
            self._word(children[0]), _only(children, syntax.ApplySyntax), _only(children, syntax.Number)
        )

    lost = interrupt

    # --- predicates

    def resource_predicate(self, children: _Children) -> syntax.PredicateSyntax:
        start, expression, end = children
        assert isinstance(start, Token) and isinstance(end, Token)
        kind = "resource" if start.type == "RESOURCE" else "data"
        span = self._span(start).to(self._span(end))
        return syntax.PredicateSyntax(kind, cast(Expression, expression), span)

    data_predicate = resource_predicate

    def implies(self, children: _Children) -> Implies:
        left, right = cast("list[Expression]", children)
        return Implies(left, right)

    def disjunction(self, children: _Children) -> Or:
        left, right = cast("list[Expression]", children)
        return Or(left, right)

    def conjunction(self, children: _Children) -> And:
        left, right = cast("list[Expression]", children)
        return And(left, right)

    def negation(self, children: _Children) -> Not:
        return Not(cast(Expression, children[0]))

    def comparison(self, children: _Children) -> Comparison:
        left, sign, right = children
        assert isinstance(left, Name | Literal) and isinstance(right, Name | Literal)
        assert left.span is not None and right.span is not None
        return Comparison(cast(Operator, str(sign)), left, right, left.span.to(right.span))

    def path(self, children: _Children) -> Name:
        words = self._words(children)
        return Name(".".join(word.text for word in words), span=words[0].span.to(words[-1].span))

    def literal(self, children: _Children) -> Literal:
        token = children[0]
        assert isinstance(token, Token)
        return Literal(_literal_value(token), self._span(token))


@dataclass(frozen=True, slots=True)
class _StartEffect:
    name: Word
    on_success: bool


def _numeric(token: Token) -> int | float:
    return float(token) if any(mark in token for mark in ".eE") else int(token)


def _literal_value(token: Token) -> bool | int | float | str:
    match token.type:
        case "TRUE":
            return True
        case "FALSE":
            return False
        case "STRING":
            return _unquoted(token)
        case _:
            return _numeric(token)


def _unquoted(token: str) -> str:
    """Undo the escapes of a string: a backslash makes the character behind it ordinary, `\\n` and `\\t` excepted."""
    escapes = {"n": "\n", "t": "\t"}
    pieces = iter(token[1:-1])
    return "".join(escapes.get(mark := next(pieces), mark) if piece == "\\" else piece for piece in pieces)


def _present(children: Iterable[object]) -> tuple[object, ...]:
    return tuple(child for child in children if child is not None)


def _only(children: Iterable[object], kind: type[_T]) -> tuple[_T, ...]:
    return tuple(child for child in children if isinstance(child, kind))


def _one(children: Iterable[object], kind: type[_T]) -> _T:
    return next(child for child in children if isinstance(child, kind))
