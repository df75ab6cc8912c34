"""Default values: valid ones for outputs and feedback, and data that satisfy the guards of the skills."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, cast

from skillwing.dsl.expressions import (
    Comparison,
    Environment,
    Expression,
    Literal,
    Name,
    UnboundNameError,
    evaluate,
    names_used,
    terms,
)
from skillwing.dsl.model import ArrayType, EnumType, Field, ScalarType, Skill, Skillset, StructType

MARGIN = 0.1
"""Distance of a number from a threshold: 1, or this share of the threshold if that is more."""
MOST_CANDIDATES = 60
PASSES = 2
"""Number of passes. A guard on two data may need the first again when the second is chosen."""


def default_value(target: Field) -> Any:
    """The declared default; else zero moved into the range, false, the first of an enum, an empty text or list."""
    if target.default is not None:
        return target.default
    return _zero(target)


def _zero(target: Field) -> Any:
    match target.type:
        case ScalarType(name="bool"):
            return False
        case ScalarType(name="string"):
            return ""
        case ScalarType() as kind:
            return _clamped(0, kind, target)
        case EnumType(values=values):
            return values[0]
        case ArrayType(element=element, length=length):
            one = Field(target.name, element, low=target.low, high=target.high)
            return [default_value(one) for _ in range(length or 0)]
        case StructType(fields=fields):
            return default_fields(fields)


def default_fields(fields: Iterable[Field]) -> dict[str, Any]:
    """A valid value for each field, by name."""
    return {each.name: default_value(each) for each in fields}


def _clamped(value: float, kind: ScalarType, target: Field) -> int | float:
    low, high = kind.bounds or (None, None)
    low = target.low if target.low is not None else low
    high = target.high if target.high is not None else high
    if low is not None:
        value = max(value, low)
    if high is not None:
        value = min(value, high)
    return int(value) if kind.is_integer else float(value)


# --- data ------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Guard:
    """A predicate on data, with default inputs of its skill."""

    expression: Expression
    inputs: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class _Leaf:
    """A datum with a single value, or such a field inside of one."""

    datum: str
    path: tuple[str, ...]
    field: Field


def default_data(skillset: Skillset) -> dict[str, Any]:
    """A valid value for each datum, such that as many guards of the skills as possible hold.

    Candidates are zero and the neighbours of thresholds in guards. One datum is chosen after the other.
    """
    fields = {item.name: Field(item.name, item.type, low=item.low, high=item.high) for item in skillset.data}
    values = {name: default_value(field) for name, field in fields.items()}
    guards = tuple(_data_guards(skillset))
    for _ in range(PASSES):
        for item in skillset.data:
            concerned = [guard for guard in guards if item.name in names_used(guard.expression, "data")]
            if not concerned:
                continue
            for leaf in _leaves(item.name, (), fields[item.name]):
                _choose(leaf, values, concerned)
    return values


def _data_guards(skillset: Skillset) -> Iterator[_Guard]:
    for skill in skillset.skills:
        inputs = default_fields(skill.inputs)
        for expression in _predicates(skill):
            if names_used(expression, "data"):
                yield _Guard(expression, inputs)


def _predicates(skill: Skill) -> Iterator[Expression]:
    yield from (check.expression for check in skill.preconditions.checks)
    yield from (invariant.expression for invariant in skill.invariants)


def _leaves(datum: str, path: tuple[str, ...], target: Field) -> Iterator[_Leaf]:
    match target.type:
        case StructType(fields=fields):
            for each in fields:
                yield from _leaves(datum, (*path, each.name), each)
        case ArrayType():
            pass
        case _:
            yield _Leaf(datum, path, target)


def _choose(leaf: _Leaf, values: dict[str, Any], guards: Sequence[_Guard]) -> None:
    """Give a leaf the first of the candidates with which most guards hold."""

    def held(candidate: Any) -> int:
        tried = {**values, leaf.datum: _with(values[leaf.datum], leaf.path, candidate)}
        return sum(_holds(guard, tried) for guard in guards)

    thresholds = [threshold for guard in guards for threshold in _thresholds(guard.expression, leaf)]
    candidates = [_at(values[leaf.datum], leaf.path), *_candidates(leaf.field, thresholds)]
    best = max(candidates, key=held)
    values[leaf.datum] = _with(values[leaf.datum], leaf.path, best)


def _holds(guard: _Guard, data: Mapping[str, Any]) -> bool:
    try:
        return evaluate(guard.expression, Environment(data=data, inputs=guard.inputs))
    except UnboundNameError:  # it names resources as well
        return False


def _candidates(target: Field, thresholds: Sequence[Any]) -> Iterator[Any]:
    match target.type:
        case EnumType(values=values):
            yield from values
        case ScalarType(name="bool"):
            yield from (False, True)
        case ScalarType(name="string"):
            yield from thresholds
        case ScalarType() as kind:
            for threshold in list(dict.fromkeys(thresholds))[:MOST_CANDIDATES]:
                step = max(1.0, abs(threshold) * MARGIN)
                yield from (_clamped(value, kind, target) for value in (threshold, threshold + step, threshold - step))
        case _:
            pass


def _thresholds(expression: Expression, leaf: _Leaf) -> Iterator[Any]:
    """The values that an expression compares a leaf with."""
    for term in terms(expression):
        match term:
            case Comparison(left=Name() as name, right=Literal(value=value)) if _is(name, leaf):
                yield value
            case Comparison(left=Literal(value=value), right=Name() as name) if _is(name, leaf):
                yield value
            case _:
                pass


def _is(name: Name, leaf: _Leaf) -> bool:
    return name.scope == "data" and name.root == leaf.datum and name.fields == leaf.path


def _at(value: Any, path: Sequence[str]) -> Any:
    for name in path:
        value = value[name]
    return value


def _with(value: Any, path: Sequence[str], inner: Any) -> Any:
    """A copy of a nested value with another value at the end of a path."""
    if not path:
        return inner
    fields = cast(dict[str, Any], value)
    return {**fields, path[0]: _with(fields[path[0]], path[1:], inner)}
