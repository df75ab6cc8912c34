"""Predicates on numbers that never hold: outside a declared range, or contradictory.

Data and inputs may have any value of their types. The check therefore considers only conjunctions of comparisons of one
name with numbers. An input has a range, declared or that of its integer type. A datum may be any number unless its
range is declared.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TypeAlias

from skillwing.dsl.checking.types import bounds_text
from skillwing.dsl.checking.wording import span_of
from skillwing.dsl.diagnostics.report import DiagnosticReport
from skillwing.dsl.expressions import And, Comparison, Expression, Literal, Name, Operator, Or
from skillwing.dsl.model import DataItem, Field, Invariant, Predicate, ScalarType, Skill, Skillset

_Ranged: TypeAlias = Field | DataItem
_MIRRORED: Mapping[str, Operator] = {"<": ">", "<=": ">=", ">": "<", ">=": "<=", "==": "=="}


@dataclass(slots=True)
class _Interval:
    """The numbers from low to high. open: the bound itself is excluded."""

    low: float = -math.inf
    high: float = math.inf
    low_open: bool = False
    high_open: bool = False

    def narrow(self, operator: Operator, value: float) -> None:
        if operator in {">", ">=", "=="} and (value, operator == ">") > (self.low, self.low_open):
            self.low, self.low_open = value, operator == ">"
        if operator in {"<", "<=", "=="} and (value, operator != "<") < (self.high, not self.high_open):
            self.high, self.high_open = value, operator == "<"

    def is_empty(self, whole: bool) -> bool:
        """True if the interval contains no number. whole: only whole numbers count."""
        if self.low > self.high or (self.low == self.high and (self.low_open or self.high_open)):
            return True
        if not whole or math.isinf(self.low) or math.isinf(self.high):
            return False
        least = math.floor(self.low) + 1 if self.low_open else math.ceil(self.low)
        return least > (math.ceil(self.high) - 1 if self.high_open else math.floor(self.high))


def report_ranges(skillset: Skillset, report: DiagnosticReport) -> None:
    """Report guards, preconditions and invariants that no number satisfies."""
    data: dict[str, _Ranged] = {item.name: item for item in skillset.data if item.low is not None}
    for event in skillset.events:
        if event.guard is not None:
            _judge("SW055", event.guard, f"The guard of `{event.name}`", data, report)
    for skill in skillset.skills:
        ranged = data | {field.name: field for field in skill.inputs}
        for code, kind, item in _on_data(skill):
            _judge(code, item.expression, f"The {kind} `{item.name}` of `{skill.name}`", ranged, report)


def _on_data(skill: Skill) -> Iterator[tuple[str, str, Predicate | Invariant]]:
    yield from (("SW050", "precondition", check) for check in skill.preconditions.checks if check.kind == "data")
    yield from (("SW051", "invariant", item) for item in skill.invariants if item.kind == "data")


def _judge(
    code: str, expression: Expression, subject: str, ranged: Mapping[str, _Ranged], report: DiagnosticReport
) -> None:
    name = _impossible(expression, ranged)
    if name is None:
        return
    interval, _ = _range(name, ranged)
    if math.isinf(interval.low) and math.isinf(interval.high):
        advice = f"It requires a number to be less and greater than another at once: fix the comparisons of `{name}`."
    else:
        advice = f"Ask for what `{name}` can be: {bounds_text(interval.low, interval.high)}."
    report.add(code, span_of(expression), f"{subject} can never hold.", advice)


def _impossible(expression: Expression, ranged: Mapping[str, _Ranged]) -> str | None:
    """The name that makes the expression unsatisfiable, with the advice; None if there is none."""
    if isinstance(expression, Or):
        left, right = _impossible(expression.left, ranged), _impossible(expression.right, ranged)
        return left if right is not None else None
    intervals: dict[str, tuple[_Interval, bool]] = {}
    for part in _conjuncts(expression):
        if isinstance(part, Or) and (name := _impossible(part, ranged)) is not None:
            return name
        for name, operator, value in _bound(part):
            interval, whole = intervals.setdefault(name, _range(name, ranged))
            interval.narrow(operator, value)
            if interval.is_empty(whole):
                return name
    return None


def _conjuncts(expression: Expression) -> Iterator[Expression]:
    if isinstance(expression, And):
        yield from _conjuncts(expression.left)
        yield from _conjuncts(expression.right)
    else:
        yield expression


def _bound(expression: Expression) -> Iterator[tuple[str, Operator, float]]:
    """The interval that a comparison of a name with a number allows."""
    match expression:
        case Comparison(operator, Name() as name, Literal(value)):
            pass
        case Comparison(operator, Literal(value), Name() as name) if operator in _MIRRORED:
            operator = _MIRRORED[operator]
        case _:
            return
    if operator in _MIRRORED and isinstance(value, int | float) and not isinstance(value, bool):
        yield name.path, operator, value


def _range(name: str, ranged: Mapping[str, _Ranged]) -> tuple[_Interval, bool]:
    """The interval of a name, and whether it is a whole number. ranged: inputs, and data with a range."""
    field = ranged.get(name)
    if field is None or not isinstance(field.type, ScalarType):
        return _Interval(), False
    interval = _Interval(*(field.type.bounds or (-math.inf, math.inf)))
    if field.low is not None and field.high is not None:
        interval = _Interval(field.low, field.high)
    return interval, field.type.is_integer
