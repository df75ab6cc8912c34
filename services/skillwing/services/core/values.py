"""Checks of values against the types, units and ranges of the model."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Literal, TypeAlias, cast

from skillwing.dsl.model import ArrayType, EnumType, Field, ScalarType, StructType, Type
from skillwing.dsl.suggest import closest, listed

LONGEST_TEXT = 2000
"""Characters of a developer's text that are sent."""
MOST_PROBLEMS = 20
"""Problems of one value after which the check stops, so that a value with a million of them costs no more time and
memory."""

ProblemKind: TypeAlias = Literal["unknown", "missing", "type", "range"]


@dataclass(frozen=True, slots=True)
class Problem:
    """One value that does not fit. path: its place (`target.x`); sentence: what is wrong, and what would be right."""

    path: str
    kind: ProblemKind
    sentence: str


def fit_fields(fields: Sequence[Field], given: Mapping[str, object]) -> tuple[dict[str, object], list[Problem]]:
    """Fit named values to the fields of an input, output, feedback or structure.

    Returns the values in declaration order, with defaults filled in and integers widened to floats where the model
    says so, and the problems found. The values are only worth anything if there is none of another kind than "range".
    Of unknown names, and of a list's wrong elements, only the first `MOST_PROBLEMS` are reported.
    """
    return _fit_fields(fields, given, prefix="")


def fit(value: object, kind: Type, path: str) -> tuple[object, list[Problem]]:
    """Fit one value to a type of the model; `path` is what problems call it."""
    return _fit(value, kind, None, path)


def _fit_fields(
    fields: Sequence[Field], given: Mapping[str, object], prefix: str
) -> tuple[dict[str, object], list[Problem]]:
    fitted: dict[str, object] = {}
    problems: list[Problem] = []
    known = 0
    for item in fields:
        name = item.name
        if name in given:
            known += 1
            fitted[name], found = _fit(given[name], item.type, item, prefix + name)
            problems += found
        elif item.default is not None:
            fitted[name] = item.default
        else:
            path = prefix + name
            problems.append(Problem(path, "missing", f"`{path}` is missing; it is {_described(item)}."))
    if known < len(given):
        names = [item.name for item in fields]
        unknown = (str(name) for name in given if name not in names)
        problems = [*(_unknown(prefix, name, names) for name in islice(unknown, MOST_PROBLEMS)), *problems]
    return fitted, problems


def _fit(value: object, kind: Type, limits: Field | None, path: str) -> tuple[object, list[Problem]]:
    match kind:
        case ScalarType():
            return _fit_scalar(value, kind, limits, path)
        case EnumType():
            return value, _enum_problems(value, kind, path)
        case ArrayType() if isinstance(value, (list, tuple)):
            return _fit_array(list(cast(Sequence[object], value)), kind, limits, path)
        case StructType() if isinstance(value, Mapping):
            return _fit_fields(kind.fields, cast(Mapping[str, object], value), prefix=f"{path}.")
        case ArrayType() | StructType():
            return value, [_mismatch(path, kind, value)]


def _fit_array(
    items: list[object], kind: ArrayType, limits: Field | None, path: str
) -> tuple[list[object], list[Problem]]:
    if kind.length is not None and len(items) != kind.length:
        sentence = f"`{path}` has {len(items)} elements; it takes {kind.length}."
        return items, [Problem(path, "type", sentence)]
    fitted: list[object] = []
    problems: list[Problem] = []
    for index, item in enumerate(items):
        value, found = _fit(item, kind.element, limits, f"{path}[{index}]")
        fitted.append(value)
        problems += found
        if len(problems) >= MOST_PROBLEMS:
            rest = f"`{path}` was not looked at any further: too much of it is wrong."
            return items, [*problems[:MOST_PROBLEMS], Problem(path, "type", rest)]
    return fitted, problems


def _enum_problems(value: object, kind: EnumType, path: str) -> list[Problem]:
    if value in kind.values:
        return []
    guess = closest(value, kind.values) if isinstance(value, str) else None
    hint = f" Did you mean `{guess}`?" if guess else ""
    sentence = f"`{path}` is {_shown(value)}; it takes one of {listed(kind.values)}.{hint}"
    return [Problem(path, "type", sentence)]


def _fit_scalar(value: object, kind: ScalarType, limits: Field | None, path: str) -> tuple[object, list[Problem]]:
    fitted = _converted(value, kind)
    if fitted is None:
        return value, [_mismatch(path, kind, value)]
    if kind.is_number:
        low, high = _bounds(kind, limits)
        number = cast(float, fitted)
        if (low is not None and number < low) or (high is not None and number > high):
            unit = f" {limits.unit}" if limits and limits.unit else ""
            shown = f"{number:g}" if _finite(number) else _shown(number)
            sentence = f"`{path}` is {shown}{unit}; it has to lie {_interval(low, high, unit)}."
            return fitted, [Problem(path, "range" if _has_form(number, kind) else "type", sentence)]
    return fitted, []


def _converted(value: object, kind: ScalarType) -> object | None:
    """The value in the form of the scalar type, or None if it is of another type."""
    if kind.name == "bool":
        return value if isinstance(value, bool) else None
    if kind.name == "string":
        return value if isinstance(value, str) else None
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return None
    if kind.is_integer:
        return value if isinstance(value, int) else None
    return float(value) if _finite(value) else None


def _finite(number: int | float) -> bool:
    try:
        return math.isfinite(number)
    except OverflowError:  # an integer beyond the floats
        return False


def _has_form(number: float, kind: ScalarType) -> bool:
    """True if the scalar type can hold the number, whatever the field allows."""
    low, high = kind.bounds or (-math.inf, math.inf)
    return low <= number <= high


def _bounds(kind: ScalarType, limits: Field | None) -> tuple[float | None, float | None]:
    """The tighter of what the type and what the field allow."""
    type_low, type_high = kind.bounds or (None, None)
    low = limits.low if limits and limits.low is not None else type_low
    high = limits.high if limits and limits.high is not None else type_high
    return low, high


def _interval(low: float | None, high: float | None, unit: str) -> str:
    if low is None:
        return f"at or below {high:g}{unit}"
    if high is None:
        return f"at or above {low:g}{unit}"
    return f"between {low:g} and {high:g}{unit}"


def _unknown(prefix: str, name: str, names: Sequence[str]) -> Problem:
    name = _cut(name)
    guess = closest(name, names)
    hint = f"; did you mean `{prefix}{guess}`?" if guess else f"; there is {listed(names)}."
    return Problem(prefix + name, "unknown", f"There is no field `{prefix}{name}`{hint}")


def _mismatch(path: str, kind: Type, value: object) -> Problem:
    return Problem(path, "type", f"`{path}` is {_shown(value)}; it takes {type_text(kind)}.")


def _shown(value: object) -> str:
    try:
        text = _written(value)
    except ValueError:  # an integer of thousands of digits
        return "a number beyond all bounds"
    return _cut(text)


def _cut(text: str) -> str:
    return text if len(text) <= 60 else f"{text[:57]}..."


def _written(value: object) -> str:
    """A value in a form that does not look like Python."""
    match value:
        case bool():
            return "true" if value else "false"
        case None:
            return "nothing"
        case list() | tuple():
            return f"[{', '.join(map(_written, cast(Sequence[object], value)))}]"
        case _:
            return repr(value)


def _described(item: Field) -> str:
    unit = f" in {item.unit}" if item.unit else ""
    return f"{type_text(item.type)}{unit}"


def type_text(kind: Type) -> str:
    """A type in words: `a finite number`, `a list of 3 ...`."""
    match kind:
        case ScalarType(name="bool"):
            return "true or false"
        case ScalarType(name="string"):
            return "a text"
        case ScalarType():
            return "a finite number" if kind.is_float else f"a whole number ({kind.name})"
        case EnumType(values=values):
            return f"one of {listed(values)}"
        case ArrayType(element=element, length=length):
            return f"a list of {length or 'any length'}: each {type_text(element)}"
        case StructType(fields=fields):
            return f"a structure with the fields {listed(item.name for item in fields)}"


def sendable_text(text: str) -> str:
    """A developer's text in a form that can be sent: encodable, and of bounded length."""
    plain = text.encode(errors="replace").decode()
    return plain if len(plain) <= LONGEST_TEXT else f"{plain[:LONGEST_TEXT]}..."


def by_path(problems: list[Problem]) -> dict[str, str]:
    """Sentences of problems, by path."""
    return {problem.path: problem.sentence for problem in problems}
