"""The node builder of the `.skillset` dialect."""

from __future__ import annotations

from dataclasses import dataclass, replace

from skillwing.dsl.expressions import Expression, Literal, NamedValue
from skillwing.dsl.reading import syntax
from skillwing.dsl.reading.lexemes import Lexeme
from skillwing.dsl.reading.node_builder import NodeBuilder, number


class SkillsetBuilder(NodeBuilder):
    """Adds the rules that differ from, or do not exist in, other dialects."""

    field, invariant = syntax.FieldSyntax, syntax.InvariantSyntax
    apply, owner_policy = syntax.ApplySyntax, syntax.PolicySection

    def skillset(self, name: Lexeme, *elements: syntax.Element) -> syntax.SkillsetSyntax:
        return syntax.SkillsetSyntax(name, elements)

    # --- types and data

    def datum(
        self,
        name: Lexeme,
        type_use: syntax.TypeUse,
        unit: Lexeme | None,
        bounds: syntax.BoundsSyntax | None,
        period: Lexeme | None,
    ) -> syntax.DatumSyntax:
        return syntax.DatumSyntax(name, type_use, unit, None if period is None else number(period), bounds)

    def enum(self, name: Lexeme, *values: Lexeme) -> syntax.EnumSyntax:
        return syntax.EnumSyntax(name, values)

    def struct(self, name: Lexeme, *fields: syntax.FieldSyntax) -> syntax.StructSyntax:
        return syntax.StructSyntax(name, fields)

    def type(self, name: Lexeme, *arrays: Lexeme) -> syntax.TypeUse:
        return syntax.TypeUse(name, arrays)

    def bounds(self, low: Lexeme, high: Lexeme) -> syntax.BoundsSyntax:
        return syntax.BoundsSyntax(number(low), number(high))

    def default(self, value: Literal | NamedValue) -> Literal | NamedValue:
        return value

    def symbol(self, word: Lexeme) -> NamedValue:
        return NamedValue(word.text, word.span)

    # --- resources and events

    def transition(self, extern: Lexeme | None, source: Lexeme, target: Lexeme) -> syntax.TransitionSyntax:
        return syntax.TransitionSyntax(source, target, extern is not None)

    # --- skills

    def skill(self, name: Lexeme, *sections: syntax.Section) -> syntax.SkillSyntax:
        return syntax.SkillSyntax(name, sections)

    def inputs(self, keyword: Lexeme, *fields: syntax.FieldSyntax) -> syntax.FieldsSection:
        return self.fields(keyword, *fields)

    outputs = inputs

    def input(self, field: syntax.FieldSyntax, modifiable: Lexeme | None) -> syntax.FieldSyntax:
        return replace(field, modifiable=modifiable)

    def progress(self, keyword: Lexeme, period: Lexeme, *fields: syntax.FieldSyntax) -> syntax.ProgressSection:
        return syntax.ProgressSection(keyword, number(period), fields)

    def limit(self, keyword: Lexeme, seconds: Lexeme) -> syntax.LimitSection:
        return syntax.LimitSection(keyword, number(seconds))

    def effects(self, keyword: Lexeme, *effects: syntax.EffectSyntax) -> syntax.EffectSection:
        return syntax.EffectSection(keyword, effects)

    def effect(self, name: Lexeme, *changes: syntax.ChangeSyntax) -> syntax.EffectSyntax:
        return syntax.EffectSyntax(name, changes)

    def preconditions(self, keyword: Lexeme, *items: syntax.CheckSyntax | _StartEffect) -> syntax.PreconditionSection:
        return syntax.PreconditionSection(
            keyword,
            tuple(item for item in items if isinstance(item, syntax.CheckSyntax)),
            tuple(item.name for item in items if isinstance(item, _StartEffect) and item.on_success),
            tuple(item.name for item in items if isinstance(item, _StartEffect) and not item.on_success),
        )

    def on_success(self, effect: Lexeme) -> _StartEffect:
        return _StartEffect(effect, on_success=True)

    def on_failure(self, effect: Lexeme) -> _StartEffect:
        return _StartEffect(effect, on_success=False)

    def invariants(self, keyword: Lexeme, *invariants: syntax.InvariantSyntax) -> syntax.InvariantSection:
        return syntax.InvariantSection(keyword, invariants)

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


@dataclass(frozen=True, slots=True)
class _StartEffect:
    name: Lexeme
    on_success: bool
