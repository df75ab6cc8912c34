"""The base of all node builders: the nodes that all dialects write alike."""

from __future__ import annotations

from decimal import Decimal
from typing import cast

from skillwing.dsl.expressions import And, Comparison, Implies, Literal, Name, Not, Operator, Or
from skillwing.dsl.reading import syntax
from skillwing.dsl.reading.lexemes import Lexeme


class NodeBuilder:
    """A builder of syntax nodes. The method named after a rule gets the nodes and words within it."""

    # --- nodes of the same parts as their rules

    initial, guard = syntax.InitialSyntax, syntax.GuardSyntax
    change, check = syntax.ChangeSyntax, syntax.CheckSyntax
    implies, disjunction, conjunction, negation = Implies, Or, And, Not

    # --- declarations

    def data(self, *items: syntax.DatumSyntax) -> syntax.DataSyntax:
        return syntax.DataSyntax(items)

    def resource(
        self, name: Lexeme, *items: syntax.StatesSyntax | syntax.InitialSyntax | syntax.TransitionSyntax
    ) -> syntax.ResourceSyntax:
        return syntax.ResourceSyntax(name, items)

    def states(self, *names: Lexeme) -> syntax.StatesSyntax:
        return syntax.StatesSyntax(names)

    def event(self, name: Lexeme, *items: syntax.GuardSyntax | syntax.EventEffectSyntax) -> syntax.EventSyntax:
        return syntax.EventSyntax(name, items)

    def event_effect(self, *changes: syntax.ChangeSyntax) -> syntax.EventEffectSyntax:
        return syntax.EventEffectSyntax(changes)

    # --- parts of skills

    def fields(self, keyword: Lexeme, *fields: syntax.FieldSyntax) -> syntax.FieldsSection:
        return syntax.FieldsSection(keyword, fields)

    # --- predicates

    def comparison(self, left: Name | Literal, sign: Lexeme, right: Name | Literal) -> Comparison:
        assert left.span is not None and right.span is not None
        return Comparison(cast(Operator, sign.text), left, right, left.span.to(right.span))

    def path(self, first: Lexeme, *others: Lexeme) -> Name:
        if not others:
            return Name(first.text, span=first.span)
        path = ".".join(word.text for word in (first, *others))
        return Name(path, span=first.source.span(first.start, others[-1].end))

    def literal(self, word: Lexeme) -> Literal:
        return Literal(literal_value(word), word.span)


def number(word: Lexeme) -> syntax.Number:
    """The number that a lexeme represents."""
    return syntax.Number(_numeric(word.text), word.span)


def _numeric(text: str) -> int | float:
    """The value of a number that is finite as a float. It may have thousands of zeros, which `int` refuses."""
    return float(text) if any(mark in text for mark in ".eE") else int(Decimal(text))


def literal_value(word: Lexeme) -> bool | int | float | str:
    """The value that a lexeme represents: of a number, a string, `true` or `false`."""
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
    """Remove the escapes of a string: `\\n` and `\\t` are special, any other character stands for itself."""
    escapes = {"n": "\n", "t": "\t"}
    pieces = iter(text[1:-1])
    return "".join(escapes.get(mark := next(pieces), mark) if piece == "\\" else piece for piece in pieces)
