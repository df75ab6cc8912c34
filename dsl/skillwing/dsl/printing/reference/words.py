"""Predicates and effects in words, as Markdown."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import TypeAlias

from skillwing.dsl.checking.types import bounds_text
from skillwing.dsl.expressions import (
    And,
    Comparison,
    Expression,
    Implies,
    Literal,
    Name,
    NamedValue,
    Not,
    Operand,
    Or,
    literal_text,
)
from skillwing.dsl.model import ArrayType, DataItem, Field, StructType, Type

_VERBS = {
    "==": "is",
    "!=": "is not",
    "<": "is less than",
    "<=": "is at most",
    ">": "is greater than",
    ">=": "is at least",
}
Units: TypeAlias = Mapping[str, str]
"""The unit of each datum and input, and of their fields, by path."""


def units_of(*groups: Iterable[DataItem | Field]) -> Units:
    """Units by path; a later group hides an earlier one, as inputs hide data."""
    units: dict[str, str] = {}
    for group in groups:
        for item in group:
            units |= _units(item.name, item.type, item.unit)
    return units


def _units(path: str, declared: Type, unit: str | None) -> dict[str, str]:
    units = {} if unit is None else {path: unit}
    if isinstance(declared, StructType):
        for field in declared.fields:
            units |= _units(f"{path}.{field.name}", field.type, field.unit)
    return units


def in_words(expression: Expression, units: Units) -> str:
    """A predicate in words: "`wheels` is `PARKED` and `battery` is greater than 20.0 %"."""
    match expression:
        case Comparison(operator=sign, left=left, right=right):
            unit = units.get(_path(left) or _path(right) or "")
            return f"{_operand(left, unit)} {_VERBS[sign]} {_operand(right, unit)}"
        case And(left, right):
            return f"{_part(left, units, And)} and {_part(right, units, And)}"
        case Or(left, right):
            return f"{_part(left, units, Or)} or {_part(right, units, Or)}"
        case Implies(left, right):
            return f"if {_part(left, units)}, then {_part(right, units)}"
        case Not(operand):
            return f"not ({in_words(operand, units)})"
        case Name() | Literal():
            return f"{_operand(expression, None)} is true"


def _part(expression: Expression, units: Units, within: type[And | Or] | None = None) -> str:
    """A part of a longer sentence, in parentheses if it has another connective."""
    words = in_words(expression, units)
    composed = isinstance(expression, And | Or | Implies) and type(expression) is not within
    return f"({words})" if composed else words


def _path(operand: Operand) -> str | None:
    return operand.path if isinstance(operand, Name) else None


def _operand(operand: Operand, unit: str | None) -> str:
    match operand:
        case Name(path=path):
            return f"`{path}`"
        case NamedValue(name=name):
            return f"`{name}`"
        case Literal(value=bool() | str() as value):
            return f"`{literal_text(value)}`"
        case Literal(value=value):
            return f"{literal_text(value)} {unit}" if unit else literal_text(value)


def changes(transitions: Iterable[tuple[str, str]]) -> str:
    """An effect in words: "`wheels` becomes `PARKED`"; a dash for no change."""
    return ", ".join(f"`{resource}` becomes `{state}`" for resource, state in transitions) or "–"


def range_in_words(item: DataItem | Field) -> str:
    """The range of a number: "0.1 to 5.0"; empty if it has none."""
    return "" if item.low is None or item.high is None else bounds_text(item.low, item.high).replace("..", " to ")


def type_in_words(declared: Type, link: Callable[[str], str]) -> str:
    """A type as Markdown; `link` makes the link to a declared type."""
    if isinstance(declared, ArrayType):
        many = "list of" if declared.length is None else f"{declared.length} ×"
        return f"{many} {type_in_words(declared.element, link)}"
    return link(declared.name)
