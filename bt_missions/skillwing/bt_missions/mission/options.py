"""Values of options: from their plain form to what a mission takes, and back into words."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, TypeVar

import msgspec
from msgspec.inspect import BoolType, FloatType, IntType, NoneType, TupleType, Type, UnionType, VarTupleType

from skillwing.services.errors import InvalidOptionError


def parse_options(words: Sequence[str]) -> dict[str, Any]:
    """The options that words of the form NAME=VALUE give.

    Commas separate the values of a list and semicolons the lists of a list; anything else may be written as JSON. What
    a value has to be is for the mission to say. Raises InvalidOptionError.
    """
    options: dict[str, Any] = {}
    for word in words:
        name, equals, text = word.partition("=")
        if not equals or not name:
            raise InvalidOptionError(word, f"`{word}` is not of the form NAME=VALUE.")
        if name in options:
            raise InvalidOptionError(name, f"`{name}` is given twice; give it once.")
        options[name] = plain_value(name, text.strip())
    return options


def plain_value(name: str, text: str) -> Any:
    """The value of one option as it is typed: text, a list of texts, a list of such lists, or what JSON says."""
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


O = TypeVar("O", bound=msgspec.Struct)  # noqa: E741 - options
_COUNTS = {2: "two", 3: "three", 4: "four"}


def read_values(given: Mapping[str, Any], options: type[O]) -> O:
    """Options from plain values, where numbers may also be text, and a list of lists with one member may be that.

    Raises InvalidOptionError with a sentence that says what is wrong and what the option takes.
    """
    values: dict[str, Any] = {}
    for each in msgspec.structs.fields(options):
        if each.name in given:
            values[each.name] = _read(each, given[each.name])
        elif each.required:
            words = _words(msgspec.inspect.type_info(each.type))
            raise InvalidOptionError(each.name, f"`{each.name}` is missing; it takes {words}.")
    try:
        return options(**values)
    except ValueError as error:  # what no single value is to blame for
        name = next((name for name in values if f"`{name}`" in str(error)), "")
        raise InvalidOptionError(name, str(error)) from error


def default_values(options: type[msgspec.Struct]) -> Iterator[tuple[str, Any]]:
    """The default of each option that has one, in the plain form that `read_values` takes."""
    for each in msgspec.structs.fields(options):
        if not each.required:
            factory = each.default_factory
            default = each.default if factory is msgspec.NODEFAULT else factory()
            yield each.name, msgspec.json.decode(msgspec.json.encode(default))


def written(value: Any) -> str:
    """A value as it is typed behind the name of an option."""
    match value:
        case None:
            return "null"
        case bool():
            return str(value).lower()
        case [[*_], *_]:
            return "; ".join(written(item) for item in value)
        case [*items]:
            return ",".join(written(item) for item in items)
        case float():
            return f"{value:g}"
        case _:
            return str(value)


def _read(option: msgspec.structs.FieldInfo, value: Any) -> Any:
    kind = msgspec.inspect.type_info(option.type)
    for form in (value, [value]) if isinstance(value, list) else (value,):
        try:
            read = msgspec.convert(form, option.type, strict=False)
        except msgspec.ValidationError:
            continue
        if _is_finite(read):
            return read
    sentence = f"`{option.name}` is `{written(value)}`; it takes {_words(kind)}"
    example = (
        "" if option.default in (msgspec.NODEFAULT, None) else f", as in `{_example(option.name, option.default)}`"
    )
    raise InvalidOptionError(option.name, f"{sentence}{example}.")


def _example(name: str, default: Any) -> str:
    word = f"{name}={written(default)}"
    return f'"{word}"' if " " in word else word


def _is_finite(value: Any) -> bool:
    match value:
        case float():
            return math.isfinite(value)
        case [*items]:
            return all(_is_finite(item) for item in items)
        case _:
            return True


def _words(kind: Type) -> str:
    """What values of a type look like."""
    match kind:
        case FloatType() | IntType():
            words = ("a number" if isinstance(kind, FloatType) else "a whole number") + _range(kind)
        case BoolType():
            words = "`true` or `false`"
        case NoneType():
            words = "`null`"
        case UnionType():
            words = " or ".join(_words(each) for each in kind.types)
        case TupleType():
            words = f"{_COUNTS.get(len(kind.item_types), len(kind.item_types))} numbers with commas between them"
        case VarTupleType():
            words = f"{_words(kind.item_type)}, and semicolons between several of these"
        case _:
            words = "text"
    return words


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
