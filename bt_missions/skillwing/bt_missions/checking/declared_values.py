"""Declared types and units of the values that pass through a tree, and the rule for where a value fits."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import isfinite
from typing import TypeAlias

from skillwing.dsl.checking.units import difference
from skillwing.dsl.model import ArrayType, DataItem, EnumType, Field, ScalarType, StructType, Type, UnknownNameError
from skillwing.dsl.suggest import listed
from skillwing.services.core.values import type_text

Declared: TypeAlias = Field | DataItem
"""An input, an output, a datum or a field of one: each has a type and may have a unit."""


class NotAStructureError(LookupError):
    """A path names a field of a value without fields. `str()` is the reason, without a full stop."""


def field_at(item: Declared, fields: Sequence[str]) -> Declared:
    """The field at the end of a path below `item`. Raises NotAStructureError, or UnknownNameError."""
    path = item.name
    for name in fields:
        if not isinstance(item.type, StructType):
            raise NotAStructureError(f"`{path}` is {type_text(item.type)}, and has no field `{name}`")
        known = {field.name: field for field in item.type.fields}
        if name not in known:
            raise UnknownNameError(f"field of {path}", name, tuple(known))
        item = known[name]
        path = f"{path}.{name}"
    return item


def misfit(taken: Declared, given: Declared, text: str) -> str | None:
    """Problem of an input `taken` that reads `given`, written as `text`. None if type and unit agree.

    Limits are not compared: the robot checks them when the skill starts.
    """
    if _accepts(taken.type, given.type) and units_agree(taken.unit, given.unit):
        return None
    return f"`{taken.name}` reads `{text}`, which is {described(given)}; it takes {described(taken)}."


def case_misfit(cases: Iterable[str], given: Declared, text: str) -> str | None:
    """Problem of a choice between `cases` by the value of `given`, written as `text`. None if each is possible."""
    what = f"`variable` reads `{text}`, which is {described(given)}"
    if isinstance(given.type, ArrayType | StructType):
        return f"{what}; it takes a number, a text, or true and false."
    kind = given.type
    never = [case for case in cases if not _can_be(kind, case)]
    return f"{what}; it is never {listed(never)}." if never else None


def units_agree(one: str | None, other: str | None) -> bool:
    """True if values with these declared units may be compared and assigned. A value without a unit agrees with all."""
    return one is None or other is None or difference(one, other) is None


def described(item: Declared) -> str:
    """Type and unit in words: `a finite number in m`."""
    name = f" (`{item.type.name}`)" if isinstance(item.type, StructType | EnumType) else ""
    return f"{type_text(item.type)}{name}{f' in {item.unit}' if item.unit else ''}"


def _can_be(kind: EnumType | ScalarType, case: str) -> bool:
    if isinstance(kind, EnumType):
        return case in kind.values
    if kind.name == "bool":
        return case in ("true", "false")
    try:
        return not kind.is_number or isfinite(float(case))
    except ValueError:
        return False


def _accepts(taken: Type, given: Type) -> bool:
    """True if each value of type `given` has the form of type `taken`. A whole number is a number, an enum's a text."""
    match taken, given:
        case ScalarType(), ScalarType():
            if taken.is_float:
                return given.is_number
            return (taken.is_integer and given.is_integer) or taken == given
        case ScalarType(name="string"), EnumType():
            return True
        case ArrayType(), ArrayType():
            return taken.length in (None, given.length) and _accepts(taken.element, given.element)
        case _:
            return taken == given
