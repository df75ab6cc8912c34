"""Options of a mission: from words such as `speed=1.5` to typed values, and back to text."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Any, TypeVar, cast

import msgspec
from msgspec.inspect import (
    BoolType,
    EnumType,
    FloatType,
    IntType,
    ListType,
    LiteralType,
    NoneType,
    StrType,
    StructType,
    TupleType,
    Type,
    UnionType,
    VarTupleType,
)

from skillwing.dsl.suggest import listed, missing_names
from skillwing.services.errors import InvalidOptionError

O = TypeVar("O", bound=msgspec.Struct)  # noqa: E741 - options
_COUNTS = {2: "two", 3: "three", 4: "four"}


class InvalidOptionsError(InvalidOptionError):
    """Several wrong options of a mission. problems: a sentence for each, by its name."""

    def __init__(self, problems: Mapping[str, str]) -> None:
        self.problems = MappingProxyType(dict(problems))
        super().__init__(next(iter(problems)), "\n".join(problems.values()))


def parse_options(words: Sequence[str]) -> dict[str, Any]:
    """Plain values of words of the form NAME=VALUE, such as `route=30,0,4; 30,20,4`.

    Commas separate the values of a list, semicolons the lists of a list; other values may be written as JSON. The types
    are checked later, by the mission. Raises InvalidOptionError for all words that cannot be read.
    """
    options: dict[str, Any] = {}
    problems: dict[str, str] = {}
    for word in words:
        name, equals, text = word.partition("=")
        if not equals or not name:
            problems[word] = f"`{word}` is not of the form NAME=VALUE."
        elif name in options or name in problems:
            problems.setdefault(name, f"`{name}` is given twice; give it once.")
        else:
            try:
                options[name] = plain_value(name, text.strip())
            except InvalidOptionError as error:
                problems[name] = str(error)
    _refuse(problems)
    return options


def _refuse(problems: Mapping[str, str]) -> None:
    """Raise InvalidOptionError with all problems, by option. No effect without one."""
    if len(problems) > 1:
        raise InvalidOptionsError(problems)
    for option, sentence in problems.items():
        raise InvalidOptionError(option, sentence)


def plain_value(name: str, text: str) -> Any:
    """Plain value of one option: text, a list of texts, a list of such lists, or a value in JSON."""
    if text.startswith(("[", "{")):
        try:
            return msgspec.json.decode(text)
        except msgspec.DecodeError as error:
            raise InvalidOptionError(name, f"`{name}` looks like JSON and is not: {error}.") from error
    if ";" in text:
        return [_values(part) for part in text.split(";") if part.strip()]
    return _values(text) if "," in text else text


def _values(text: str) -> list[str]:
    return [part.strip() for part in text.split(",")]


def read_values(given: Mapping[str, Any], options: type[O], unknown: Mapping[str, str] = MappingProxyType({})) -> O:
    """Options from plain values. A number may be text, and a structure the list of its values. A list with one list in
    it may be just that list.

    unknown: a sentence for each given name that is no option. Raises InvalidOptionError with a sentence about each
    problem, and about the values that the option takes.
    """
    fields = msgspec.structs.fields(options)
    values: dict[str, Any] = {}
    problems = dict(unknown)
    for each in fields:
        if each.name in given:
            try:
                values[each.name] = _read(each, given[each.name])
            except InvalidOptionError as error:
                problems[each.name] = str(error)
    lacking = missing_names([each.name for each in fields if each.required and each.name not in given], unknown)
    for each in fields:
        if each.name in lacking:
            takes = _type_text(msgspec.inspect.type_info(each.type))
            problems[each.name] = f"`{each.name}` is missing; it takes {takes}."
    _refuse(problems)
    try:
        return options(**values)
    except ValueError as error:  # a combination of values that the options refuse
        name = next((name for name in values if f"`{name}`" in str(error)), "")
        raise InvalidOptionError(name, str(error)) from error


def default_values(options: type[msgspec.Struct]) -> Iterator[tuple[str, Any]]:
    """Default of each option that has one, as a plain value for `read_values`."""
    for each in msgspec.structs.fields(options):
        if not each.required:
            factory = each.default_factory
            default = each.default if factory is msgspec.NODEFAULT else factory()
            yield each.name, msgspec.json.decode(msgspec.json.encode(default))


def option_text(value: Any) -> str:
    """A value as a user types it after the name of an option."""
    match value:
        case None:
            return "null"
        case bool():
            return str(value).lower()
        case {}:
            return _structure_text(cast("Mapping[str, Any]", value))
        case [*items]:
            between = "; " if items and isinstance(items[0], list | tuple | Mapping) else ","
            return between.join(option_text(item) for item in items)
        case float():
            return f"{value:g}"
        case _:
            return str(value)


def _structure_text(value: Mapping[str, Any]) -> str:
    """The values of a structure with commas between them, or JSON if one of them has parts itself."""
    if any(isinstance(each, Mapping | list) for each in value.values()):
        return msgspec.json.encode(value).decode()
    return ",".join(option_text(each) for each in value.values())


def _read(option: msgspec.structs.FieldInfo, value: Any) -> Any:
    kind = msgspec.inspect.type_info(option.type)
    for form in (value, [value]) if isinstance(value, list) else (value,):
        try:
            read = msgspec.convert(_shaped(form, kind), option.type, strict=False)
        except msgspec.ValidationError:
            continue
        if _is_finite(msgspec.to_builtins(read)):
            return read
    sentence = f"`{option.name}` is `{option_text(value)}`; it takes {_type_text(kind)}"
    example = (
        "" if option.default in (msgspec.NODEFAULT, None) else f", as in `{_example(option.name, option.default)}`"
    )
    raise InvalidOptionError(option.name, f"{sentence}{example}.")


def _shaped(value: Any, kind: Type) -> Any:
    """A plain value, with mappings in place of the lists that stand for structures."""
    match kind:
        case StructType() if not isinstance(value, Mapping):
            parts = value if isinstance(value, list) else [value]
            if len(parts) != len(kind.fields):
                return value
            return {
                field.encode_name: _shaped(part, field.type) for field, part in zip(kind.fields, parts, strict=True)
            }
        case ListType() | VarTupleType() if isinstance(value, list):
            return [_shaped(part, kind.item_type) for part in value]
        case UnionType() if len(others := [each for each in kind.types if not isinstance(each, NoneType)]) == 1:
            return _shaped(value, others[0])
        case _:
            return value


def _example(name: str, default: Any) -> str:
    word = f"{name}={option_text(msgspec.to_builtins(default))}"
    return f'"{word}"' if " " in word else word


def _is_finite(value: Any) -> bool:
    match value:
        case float():
            return math.isfinite(value)
        case [*items]:
            return all(_is_finite(item) for item in items)
        case {**items}:
            return all(_is_finite(item) for item in items.values())
        case _:
            return True


def _type_text(kind: Type) -> str:
    """Description of the values that a type takes."""
    match kind:
        case FloatType() | IntType():
            text = ("a number" if isinstance(kind, FloatType) else "a whole number") + _range(kind)
        case BoolType():
            text = "`true` or `false`"
        case NoneType():
            text = "`null`"
        case UnionType():
            text = " or ".join(_type_text(each) for each in kind.types)
        case TupleType():
            text = f"{_COUNTS.get(len(kind.item_types), len(kind.item_types))} numbers with commas between them"
        case StructType():
            text = f"{listed(field.encode_name for field in kind.fields)} with commas between their values, or JSON"
        case EnumType():
            text = f"one of {listed(str(each.value) for each in kind.cls)}"
        case LiteralType():
            text = f"one of {listed(map(str, kind.values))}"
        case VarTupleType() | ListType():
            text = f"{_type_text(kind.item_type)}, and semicolons between several of these"
        case StrType():
            text = "text"
        case _:
            text = "JSON"
    return text


def _range(kind: FloatType | IntType) -> str:
    low = kind.ge if kind.ge is not None else kind.gt
    high = kind.le if kind.le is not None else kind.lt
    match low, high:
        case None, None:
            return ""
        case _, None:
            return f" above {low:g}" if kind.ge is None else f" of at least {low:g}"
        case None, _:
            return f" below {high:g}" if kind.le is None else f" of at most {high:g}"
        case _:
            return f" from {low:g} to {high:g}"
