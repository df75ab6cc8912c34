"""All errors of a file's content against its structures, in words for its author. Pure.

The library that reads the file stops at the first error. Places count from one: `fault 2 zone` is in the second fault.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import suppress
from difflib import get_close_matches
from typing import Any, cast

import msgspec
from msgspec import inspect
from msgspec.structs import FieldInfo

LONGEST_VALUE = 40
"""Largest number of letters of a wrong value that are shown."""


def field_errors(content: object, kind: type[msgspec.Struct], place: str = "") -> Iterator[str]:
    """A clause for each error in `content`, as read from TOML or JSON; none if it fits."""
    if not isinstance(content, dict):
        yield _at(place, f"this has to be a section, not {_shown(content)}")
        return
    written = cast("dict[str, object]", content)
    fields = {field.encode_name: field for field in msgspec.structs.fields(kind)}
    meant = {name: get_close_matches(name, fields, 1) for name in written if name not in fields}
    found = [_unknown(name, guess, fields) for name, guess in meant.items()]
    # A mistyped field is not missing as well.
    guessed = {name for guess in meant.values() for name in guess}
    absent = [name for name, field in fields.items() if field.required and name not in {*written, *guessed}]
    found += [f"`{name}` is missing" for name in absent]
    inner = [each for name, value in written.items() if name in fields for each in _inside(value, fields[name], place)]
    yield from (_at(place, each) for each in found)
    yield from inner
    if not meant and not absent and not inner:
        try:
            msgspec.convert(written, kind)
        except msgspec.ValidationError as error:
            # A rule of the structure itself, with its own text.
            yield _at(place, str(error).partition(" - at `$")[0])


def _inside(value: object, field: FieldInfo, place: str) -> Iterator[str]:
    """Errors of a value in the section at that place."""
    with suppress(msgspec.ValidationError):
        msgspec.convert(value, field.type)
        return
    wanted = _without_none(inspect.type_info(field.type))
    here = f"{place} {field.encode_name}".strip()
    match wanted:
        case inspect.StructType(cls=kind):
            yield from field_errors(value, kind, here)
        case inspect.VarTupleType(item_type=inspect.StructType(cls=kind)) if isinstance(value, list):
            for number, each in enumerate(cast("list[object]", value), 1):
                yield from field_errors(each, kind, f"{here} {number}")
        case _:
            yield _at(place, f"`{field.encode_name}` has to be {_words(wanted)}, not {_shown(value)}")


def _without_none(wanted: inspect.Type) -> inspect.Type:
    """The type without None: a file leaves a value out instead."""
    if isinstance(wanted, inspect.UnionType):
        return next(each for each in wanted.types if not isinstance(each, inspect.NoneType))
    return wanted


def _words(wanted: inspect.Type) -> str:
    match wanted:
        case inspect.FloatType():
            return f"a number{_bounds(wanted)}"
        case inspect.BoolType():
            return "true or false"
        case inspect.StrType():
            return "a text"
        case inspect.LiteralType(values=values):
            return f"one of {', '.join(map(str, values))}"
        case inspect.TupleType(item_types=items):
            bounds = _bounds(items[0]) if isinstance(items[0], inspect.FloatType) else ""
            return f"a list of {len(items)} numbers{bounds}"
        case _:
            return "a list of sections"


def _bounds(number: inspect.FloatType) -> str:
    if number.ge is not None and number.le is not None:
        return f" from {number.ge:,.12g} to {number.le:,.12g}"
    if number.gt is not None and number.le is not None:
        return f" above {number.gt:,.12g} and up to {number.le:,.12g}"
    return ""


def _unknown(name: str, guess: list[str], fields: dict[str, Any]) -> str:
    hint = f"; did you mean `{guess[0]}`" if guess else ""
    return f"there is no `{name}`{hint}; known are {', '.join(fields)}"


def _at(place: str, what: str) -> str:
    return f"{place}: {what}" if place else what


def _shown(value: object) -> str:
    try:
        text = json.dumps(value, default=str, ensure_ascii=False)
    except (ValueError, RecursionError):
        # TOML's 0xfff... may have more digits, and its a.b.c... more levels, than Python can write.
        return "something too large to be shown"
    return text if len(text) <= LONGEST_VALUE else f"{text[: LONGEST_VALUE - 4]} ..."
