"""The node builder of the `.rl` dialect."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TypeVar

from skillwing.dsl.expressions import And, Expression, Implies, Not, Or
from skillwing.dsl.reading import syntax
from skillwing.dsl.reading.lexemes import Lexeme
from skillwing.dsl.reading.node_builder import NodeBuilder, number
from skillwing.dsl.reading.rl.syntax import (
    EVERY_STATE,
    ChecksNode,
    IncludeNode,
    InterruptNode,
    InvariantNode,
    InvariantsNode,
    Node,
    ParametersNode,
    PostNode,
    ResultNode,
    ResultsNode,
    RlFile,
    SectionNode,
    SkillNode,
    StartNode,
    TypesNode,
)
from skillwing.dsl.spans import Span

_Kind = TypeVar("_Kind")


class RlBuilder(NodeBuilder):
    """Builder that adds the rules of this dialect. The node of the whole file is an `RlFile`."""

    post = PostNode

    def skillset(self, *children: Node | Lexeme | None) -> RlFile:
        nodes = tuple(child for child in children if not isinstance(child, Lexeme | None))
        return RlFile(next(iter(_only(children, Lexeme)), None), nodes)

    def include(self, *files: Lexeme) -> IncludeNode:
        return IncludeNode(files)

    # --- types, parameters and data

    def types(self, *names: Lexeme) -> TypesNode:
        return TypesNode(names)

    def parameters(self, keyword: Lexeme, *fields: syntax.FieldSyntax) -> ParametersNode:
        return ParametersNode(keyword, fields)

    def field(self, name: Lexeme, type_use: syntax.TypeUse) -> syntax.FieldSyntax:
        return syntax.FieldSyntax(name, type_use, unit=None, bounds=None, default=None)

    def type(self, name: Lexeme) -> syntax.TypeUse:
        return syntax.TypeUse(name, arrays=())

    def datum(self, name: Lexeme, type_use: syntax.TypeUse, period: syntax.Number | None) -> syntax.DatumSyntax:
        return syntax.DatumSyntax(name, type_use, unit=None, period=period)

    def period(self, amount: Lexeme, unit: Lexeme | None) -> syntax.Number:
        """A period in seconds, which is the default unit."""
        written = number(amount)
        if unit is None:
            return written
        span = amount.source.span(amount.start, unit.end)
        return syntax.Number(written.value / 1000 if unit.kind == "MS" else written.value, span)

    # --- resources

    def all_transitions(self, word: Lexeme) -> syntax.TransitionSyntax:
        every_state = syntax.CoinedWord(EVERY_STATE, word.span)
        return syntax.TransitionSyntax(every_state, every_state, extern=False)

    def transition(self, source: Lexeme, target: Lexeme) -> syntax.TransitionSyntax:
        return syntax.TransitionSyntax(source, target, extern=False)

    # --- skills

    def skill(self, name: Lexeme, *sections: SectionNode) -> SkillNode:
        return SkillNode(name, sections)

    def checks(self, keyword: Lexeme, *checks: syntax.CheckSyntax) -> ChecksNode:
        return ChecksNode(keyword, checks)

    def start(self, keyword: Lexeme, *changes: syntax.ChangeSyntax) -> StartNode:
        return StartNode(keyword, changes)

    def invariants(self, keyword: Lexeme, *invariants: InvariantNode) -> InvariantsNode:
        return InvariantsNode(keyword, invariants)

    def invariant(self, name: Lexeme, guard: syntax.GuardSyntax, *effects: syntax.EventEffectSyntax) -> InvariantNode:
        return InvariantNode(name, guard.predicate, _changes(effects))

    def progress(self, keyword: Lexeme, period: syntax.Number, *fields: syntax.FieldSyntax) -> syntax.ProgressSection:
        return syntax.ProgressSection(keyword, period, fields)

    def interrupt(self, keyword: Lexeme, *items: syntax.EventEffectSyntax | PostNode | None) -> InterruptNode:
        return InterruptNode(keyword, _changes(items), _only(items, PostNode))

    def interrupting(self, _value: Lexeme) -> None:
        """Ignore the value: a skill that stops at once confirms at once, by default of the managers (docs/onera.md)."""

    def results(self, keyword: Lexeme, *results: ResultNode) -> ResultsNode:
        return ResultsNode(keyword, results)

    def result(self, name: Lexeme, *items: syntax.EventEffectSyntax | PostNode) -> ResultNode:
        return ResultNode(name, _changes(items), _only(items, PostNode))

    # --- predicates

    def predicate(self, expression: Expression) -> syntax.PredicateSyntax:
        return syntax.PredicateSyntax("resource", expression, _extent(expression))


def _only(children: Iterable[object], kind: type[_Kind]) -> tuple[_Kind, ...]:
    return tuple(child for child in children if isinstance(child, kind))


def _changes(items: Iterable[object]) -> tuple[syntax.ChangeSyntax, ...]:
    return tuple(change for effect in _only(items, syntax.EventEffectSyntax) for change in effect.changes)


def _extent(expression: Expression) -> Span:
    """The span from the first word to the last. Uses no recursion, because expressions may be nested deeply."""
    first = last = expression
    while isinstance(first, And | Or | Implies | Not):
        first = first.operand if isinstance(first, Not) else first.left
    while isinstance(last, And | Or | Implies | Not):
        last = last.operand if isinstance(last, Not) else last.right
    assert first.span is not None and last.span is not None
    return first.span.to(last.span)
