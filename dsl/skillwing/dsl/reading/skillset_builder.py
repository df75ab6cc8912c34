"""The nodes of the `.skillset` dialect: the method named after a rule of `skillset.lark` builds the rule's node."""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast

from skillwing.dsl.expressions import And, Comparison, Expression, Implies, Literal, Name, Not, Operator, Or, Symbol
from skillwing.dsl.reading import syntax
from skillwing.dsl.reading.lexemes import Lexeme


class SkillsetBuilder:
    """Builds each rule's node from the nodes and words within it."""

    def skillset(self, name: Lexeme, *elements: syntax.Element) -> syntax.SkillsetSyntax:
        return syntax.SkillsetSyntax(name, elements)

    # --- types and data

    def data(self, *items: syntax.DatumSyntax) -> syntax.DataSyntax:
        return syntax.DataSyntax(items)

    def datum(
        self, name: Lexeme, type_use: syntax.TypeUse, unit: Lexeme | None, period: Lexeme | None
    ) -> syntax.DatumSyntax:
        return syntax.DatumSyntax(name, type_use, unit, None if period is None else number(period))

    def enum(self, name: Lexeme, *values: Lexeme) -> syntax.EnumSyntax:
        return syntax.EnumSyntax(name, values)

    def struct(self, name: Lexeme, *fields: syntax.FieldSyntax) -> syntax.StructSyntax:
        return syntax.StructSyntax(name, fields)

    def field(
        self,
        name: Lexeme,
        type_use: syntax.TypeUse,
        unit: Lexeme | None,
        bounds: syntax.BoundsSyntax | None,
        default: Literal | Symbol | None,
    ) -> syntax.FieldSyntax:
        return syntax.FieldSyntax(name, type_use, unit, bounds, default)

    def type(self, name: Lexeme, *arrays: Lexeme) -> syntax.TypeUse:
        return syntax.TypeUse(name, arrays)

    def bounds(self, low: Lexeme, high: Lexeme) -> syntax.BoundsSyntax:
        return syntax.BoundsSyntax(number(low), number(high))

    def default(self, value: Literal | Symbol) -> Literal | Symbol:
        return value

    def symbol(self, word: Lexeme) -> Symbol:
        return Symbol(word.text, word.span)

    # --- resources and events

    def resource(
        self, name: Lexeme, *items: syntax.StatesSyntax | syntax.InitialSyntax | syntax.TransitionSyntax
    ) -> syntax.ResourceSyntax:
        return syntax.ResourceSyntax(name, items)

    def states(self, *names: Lexeme) -> syntax.StatesSyntax:
        return syntax.StatesSyntax(names)

    def initial(self, state: Lexeme) -> syntax.InitialSyntax:
        return syntax.InitialSyntax(state)

    def transition(self, extern: Lexeme | None, source: Lexeme, target: Lexeme) -> syntax.TransitionSyntax:
        return syntax.TransitionSyntax(source, target, extern is not None)

    def event(self, name: Lexeme, *items: syntax.GuardSyntax | syntax.EventEffectSyntax) -> syntax.EventSyntax:
        return syntax.EventSyntax(name, items)

    def guard(self, predicate: syntax.PredicateSyntax) -> syntax.GuardSyntax:
        return syntax.GuardSyntax(predicate)

    def event_effect(self, *changes: syntax.ChangeSyntax) -> syntax.EventEffectSyntax:
        return syntax.EventEffectSyntax(changes)

    # --- skills

    def skill(self, name: Lexeme, *sections: syntax.Section) -> syntax.SkillSyntax:
        return syntax.SkillSyntax(name, sections)

    def progress(self, keyword: Lexeme, period: Lexeme, *fields: syntax.FieldSyntax) -> syntax.ProgressSection:
        return syntax.ProgressSection(keyword, number(period), fields)

    def limit(self, keyword: Lexeme, seconds: Lexeme) -> syntax.LimitSection:
        return syntax.LimitSection(keyword, number(seconds))

    def fields(self, keyword: Lexeme, *fields: syntax.FieldSyntax) -> syntax.FieldsSection:
        return syntax.FieldsSection(keyword, fields)

    def effects(self, keyword: Lexeme, *effects: syntax.EffectSyntax) -> syntax.EffectSection:
        return syntax.EffectSection(keyword, effects)

    def effect(self, name: Lexeme, *changes: syntax.ChangeSyntax) -> syntax.EffectSyntax:
        return syntax.EffectSyntax(name, changes)

    def change(self, resource: Lexeme, target: Lexeme) -> syntax.ChangeSyntax:
        return syntax.ChangeSyntax(resource, target)

    def preconditions(self, keyword: Lexeme, *items: syntax.CheckSyntax | _StartEffect) -> syntax.PreconditionSection:
        return syntax.PreconditionSection(
            keyword,
            tuple(item for item in items if isinstance(item, syntax.CheckSyntax)),
            tuple(item.name for item in items if isinstance(item, _StartEffect) and item.on_success),
            tuple(item.name for item in items if isinstance(item, _StartEffect) and not item.on_success),
        )

    def check(self, name: Lexeme, predicate: syntax.PredicateSyntax) -> syntax.CheckSyntax:
        return syntax.CheckSyntax(name, predicate)

    def on_success(self, effect: Lexeme) -> _StartEffect:
        return _StartEffect(effect, on_success=True)

    def on_failure(self, effect: Lexeme) -> _StartEffect:
        return _StartEffect(effect, on_success=False)

    def invariants(self, keyword: Lexeme, *invariants: syntax.InvariantSyntax) -> syntax.InvariantSection:
        return syntax.InvariantSection(keyword, invariants)

    def invariant(
        self, name: Lexeme, predicate: syntax.PredicateSyntax, violation: Lexeme | None
    ) -> syntax.InvariantSyntax:
        return syntax.InvariantSyntax(name, predicate, violation)

    def results(self, keyword: Lexeme, *results: syntax.ResultSyntax) -> syntax.ResultSection:
        return syntax.ResultSection(keyword, results)

    def result(
        self,
        partition: Lexeme | None,
        name: Lexeme,
        apply: syntax.ApplySyntax | None,
        post: syntax.PredicateSyntax | None,
    ) -> syntax.ResultSyntax:
        return syntax.ResultSyntax(name, None if partition is None else partition.text, apply, post)

    def apply(self, effect: Lexeme) -> syntax.ApplySyntax:
        return syntax.ApplySyntax(effect)

    def timeout(self, seconds: Lexeme) -> syntax.Number:
        return number(seconds)

    def end(self, keyword: Lexeme, *items: syntax.ApplySyntax | syntax.Number) -> syntax.EndSection:
        return syntax.EndSection(
            keyword,
            tuple(item for item in items if isinstance(item, syntax.ApplySyntax)),
            tuple(item for item in items if isinstance(item, syntax.Number)),
        )

    # --- predicates

    def predicate(self, kind: Lexeme, expression: Expression, closing: Lexeme) -> syntax.PredicateSyntax:
        span = kind.source.span(kind.start, closing.end)
        return syntax.PredicateSyntax("resource" if kind.kind == "RESOURCE" else "data", expression, span)

    def implies(self, left: Expression, right: Expression) -> Implies:
        return Implies(left, right)

    def disjunction(self, left: Expression, right: Expression) -> Or:
        return Or(left, right)

    def conjunction(self, left: Expression, right: Expression) -> And:
        return And(left, right)

    def negation(self, operand: Expression) -> Not:
        return Not(operand)

    def comparison(self, left: Name | Literal, sign: Lexeme, right: Name | Literal) -> Comparison:
        assert left.span is not None and right.span is not None
        return Comparison(cast(Operator, sign.text), left, right, left.span.to(right.span))

    def path(self, first: Lexeme, *others: Lexeme) -> Name:
        if not others:
            return Name(first.text, span=first.span)
        path = ".".join(word.text for word in (first, *others))
        return Name(path, span=first.source.span(first.start, others[-1].end))

    def literal(self, word: Lexeme) -> Literal:
        return Literal(_literal_value(word), word.span)


@dataclass(frozen=True, slots=True)
class _StartEffect:
    name: Lexeme
    on_success: bool


def number(word: Lexeme) -> syntax.Number:
    """The number that a word of digits stands for."""
    return syntax.Number(_numeric(word.text), word.span)


def _numeric(text: str) -> int | float:
    return float(text) if any(mark in text for mark in ".eE") else int(text)


def _literal_value(word: Lexeme) -> bool | int | float | str:
    match word.kind:
        case "TRUE":
            return True
        case "FALSE":
            return False
        case "STRING":
            return _unquoted(word.text)
        case _:
            return _numeric(word.text)


def _unquoted(text: str) -> str:
    """Undo the escapes of a string: a backslash makes the character behind it ordinary, `\\n` and `\\t` excepted."""
    escapes = {"n": "\n", "t": "\t"}
    pieces = iter(text[1:-1])
    return "".join(escapes.get(mark := next(pieces), mark) if piece == "\\" else piece for piece in pieces)
