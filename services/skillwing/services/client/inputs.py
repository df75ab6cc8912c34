"""A skill's inputs as words: `height=5`, `target=10,5,4`, `target.x=10`, `target={"x": 10}`."""

from __future__ import annotations

import json
import math
from collections.abc import Collection, Sequence
from typing import Any, cast

import msgspec

from skillwing.dsl.model import ArrayType, EnumType, Field, ScalarType, Skill, StructType, Type, UnknownNameError
from skillwing.dsl.suggest import closest, listed
from skillwing.services.core.values import fit_fields, type_text
from skillwing.services.errors import InvalidInputError

TRUTHS = {"true": True, "false": False}
MOST_SHOWN = 80
"""Letters of a word that a message repeats."""


class MalformedValueError(Exception):
    """A text that is no value of its type; `str()` describes the expected form."""


def parse_inputs(skill: Skill, words: Sequence[str], *, partial: bool = False) -> dict[str, Any]:
    """The inputs in words of the form NAME=VALUE, with the types that the skill declares.

    Structures and arrays are values separated by commas, JSON, or field by field. Raises InvalidInputError with a
    sentence for each word that cannot be read, and then also for each missing input and each value out of range. If all
    words can be read, `SkillsetInterface.start` checks the values. partial: no input is missing.
    """
    values: dict[str, Any] = {}
    problems: dict[str, str] = {}
    meant: set[str] = set()
    for word in words:
        path, equals, text = word.partition("=")
        if not equals or not path:
            problems[word] = f"`{word}` is not of the form NAME=VALUE."
            continue
        name, *rest = path.split(".")
        try:
            field = skill.input(name)
        except UnknownNameError as error:
            problems[path] = str(error)
            meant.add(closest(name, error.known) or name)
            continue
        kind = _type_at(field, rest)
        if kind is None:
            problems[path] = f"`{name}` has no field `{'.'.join(rest)}`; it is {type_text(field.type)}."
            continue
        try:
            value = read_value(text, kind, path)
        except MalformedValueError as error:
            problems[path] = f"`{path}` is `{_shown(text)}`; it takes {error}."
            continue
        if not _put(values, [name, *rest], value):
            problems[path] = f"`{path}` is given twice; give it once."
    if problems:
        fields = [skill.input(name) for name in values] if partial else skill.inputs
        raise InvalidInputError(skill.name, problems | _unfit(fields, values, {*problems, *meant}))
    return values


def _unfit(fields: Sequence[Field], values: dict[str, Any], reported: Collection[str]) -> dict[str, str]:
    """Problems of values. reported: paths that have, or contain, a reported problem."""
    _, found = fit_fields(fields, values)
    return {
        each.path: each.sentence
        for each in found
        if not any(f"{path}.".startswith(f"{each.path}.") for path in reported)
    }


def _type_at(field: Field, path: Sequence[str]) -> Type | None:
    kind = field.type
    for name in path:
        fields = {item.name: item.type for item in kind.fields} if isinstance(kind, StructType) else {}
        if name not in fields:
            return None
        kind = fields[name]
    return kind


def _put(values: dict[str, Any], path: Sequence[str], value: Any) -> bool:
    """Put a value at its place in nested mappings; False for a place that is taken."""
    *parents, last = path
    for name in parents:
        inner = values.setdefault(name, {})
        if not isinstance(inner, dict):
            return False
        values = cast(dict[str, Any], inner)
    if last in values:
        return False
    values[last] = value
    return True


def read_value(text: str, kind: Type, path: str) -> Any:
    """The value of a text. Raises MalformedValueError. path: name of the value in messages."""
    match kind:
        case ScalarType():
            return _read_scalar(text, kind)
        case EnumType():
            return text
        case ArrayType() | StructType() if text.lstrip().startswith(("[", "{")):
            return _read_json(text, kind)
        case ArrayType(element=element):
            return [read_value(part.strip(), element, path) for part in text.split(",")] if text else []
        case StructType(fields=fields):
            if any(isinstance(field.type, ArrayType | StructType) for field in fields):
                first = fields[0].name
                names = listed(field.name for field in fields)
                raise MalformedValueError(f"{names}: each by itself, as in `{path}.{first}=VALUE`, or all as JSON")
            parts = text.split(",")
            if len(parts) != len(fields):
                raise MalformedValueError(f"{len(fields)} values separated by commas, {_names(fields)}")
            named = zip(fields, parts, strict=True)
            return {field.name: read_value(part.strip(), field.type, path) for field, part in named}


def _read_scalar(text: str, kind: ScalarType) -> bool | int | float | str:
    if kind.name == "string":
        return text
    if kind.name == "bool":
        if text.lower() not in TRUTHS:
            raise MalformedValueError(type_text(kind))
        return TRUTHS[text.lower()]
    try:
        number = int(text) if kind.is_integer else float(text)
        if math.isfinite(number):
            return number
    except (ValueError, OverflowError):
        pass
    raise MalformedValueError(type_text(kind))


def _read_json(text: str, kind: Type) -> Any:
    try:
        return msgspec.json.decode(text)
    except (ValueError, RecursionError) as error:
        raise MalformedValueError(f"{type_text(kind)}, and as JSON it {_wrong_in(text)}") from error


def _wrong_in(text: str) -> str:
    """The error in a text that is no JSON. Python's own reader accepts more, and gives the place."""
    try:
        json.loads(text, parse_int=_finite, parse_float=_finite, parse_constant=_finite)
    except json.JSONDecodeError as error:
        return "is wrong at its end" if error.pos >= len(text) else f"is wrong at `{_shown(text[error.pos :])}`"
    except RecursionError:
        return "is nested too deeply"
    return "has half a character in a text: one of a surrogate pair without the other"


def _finite(number: str) -> float:
    """A finite number; raises for `NaN` and `Infinity`, which Python accepts, and for numbers beyond a float's
    range."""
    value = float(number)
    if not math.isfinite(value):
        raise MalformedValueError(f"finite numbers only, and `{_shown(number)}` is none")
    return value


def _shown(text: str) -> str:
    return text if len(text) <= MOST_SHOWN else f"{text[:MOST_SHOWN]}..."


def _names(fields: Sequence[Field]) -> str:
    return ",".join(field.name for field in fields)
