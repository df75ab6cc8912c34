"""Messages described in Markdown: their fields with types and bounds, as msgspec enforces them; and as JSON Schema."""

from __future__ import annotations

import inspect as python_inspect
from collections.abc import Iterable, Iterator
from typing import Any, TypeAlias

import msgspec
from msgspec import NODEFAULT, inspect

Structure: TypeAlias = type[msgspec.Struct]
DIALECT = "https://json-schema.org/draft/2020-12/schema"
REFERENCE = "#/$defs/{name}"
BOUNDS = (("ge", "≥"), ("gt", ">"), ("le", "≤"), ("lt", "<"))
PLAIN: dict[type[inspect.Type], str] = {
    inspect.AnyType: "any",
    inspect.NoneType: "nil",
    inspect.BoolType: "bool",
    inspect.IntType: "int",
    inspect.FloatType: "float",
    inspect.StrType: "str",
}


def classes_of(kind: Any) -> tuple[Structure, ...]:
    """The message classes that a class or a union of classes stands for."""
    described = inspect.type_info(kind)
    members = described.types if isinstance(described, inspect.UnionType) else (described,)
    return tuple(member.cls for member in members if isinstance(member, inspect.StructType))


def sections(kinds: Iterable[Any]) -> Iterator[str]:
    """The sections of these messages and of the structures inside them, each once."""
    classes = _classes(kinds)
    inner = [each.cls for each in _parts(classes) if isinstance(each, inspect.StructType)]
    for cls in dict.fromkeys((*classes, *inner)):
        yield from _section(cls)


def enumerations(kinds: Iterable[Any]) -> Iterator[str]:
    """The sections of the enumerations inside these messages, each once."""
    for cls in dict.fromkeys(each.cls for each in _parts(_classes(kinds)) if isinstance(each, inspect.EnumType)):
        yield from (f"### {cls.__name__}", "")
        yield from (cls.__doc__, "") if cls.__doc__ else ()
        yield from (f"{', '.join(f'`{member.value}`' for member in cls)}.", "")


def link(name: str) -> str:
    """A link to the section of a message or enumeration."""
    return f"[`{name}`](#{name.lower()})"


def links(kind: Any) -> str:
    """Links to all messages that a class or union stands for."""
    return " or ".join(link(cls.__name__) for cls in classes_of(kind))


def _section(cls: Structure) -> list[str]:
    """The section of one message: what it says, and its fields."""
    described = inspect.type_info(cls)
    assert isinstance(described, inspect.StructType)
    lines = [f"### {cls.__name__}", ""]
    if cls.__doc__:
        lines += [python_inspect.cleandoc(cls.__doc__), ""]
    lines += ["| field | type | if left out |", "|---|---|---|"]
    if described.tag is not None:
        lines.append(f"| `{described.tag_field}` | `{_value(described.tag)}` | has to be given |")
    # What is common to all messages comes first in Python, and is the least interesting.
    for field in sorted(described.fields, key=lambda field: field.name == "v"):
        lines.append(f"| `{field.encode_name}` | {type_text(field.type)} | {_if_left_out(field)} |")
    return [*lines, ""]


def definitions(kinds: Iterable[Any]) -> dict[str, Any]:
    """These messages and the structures inside them as JSON Schema, by name. `REFERENCE` spells a reference to one."""
    return msgspec.json.schema_components(_classes(kinds), ref_template=REFERENCE)[1]


def type_text(described: inspect.Type) -> str:
    """A type in a few words, with its bounds."""
    match described:
        case inspect.UnionType(types=types):
            text = " or ".join(type_text(each) for each in types)
        case inspect.StructType(cls=cls) | inspect.EnumType(cls=cls):
            text = link(cls.__name__)
        case inspect.LiteralType(values=values):
            text = " or ".join(f"`{_value(value)}`" for value in values)
        case inspect.DictType(key_type=key, value_type=value):
            text = f"map of {type_text(key)} to {type_text(value)}"
        case inspect.ListType(item_type=item) | inspect.VarTupleType(item_type=item):
            text = f"array of {type_text(item)}"
        case inspect.TupleType(item_types=items):
            text = f"array of {len(items)}: {', '.join(type_text(each) for each in items)}"
        case _:
            text = PLAIN[type(described)] + "".join(_bounds(described))
    return text


def _bounds(described: inspect.Type) -> Iterator[str]:
    for attribute, sign in BOUNDS:
        bound = getattr(described, attribute, None)
        if bound is not None:
            yield f" {sign} {bound:g}".replace("e+0", "e")
    if getattr(described, "max_length", None) is not None:
        yield f", at most {described.max_length} characters"  # pyright: ignore[reportAttributeAccessIssue]


def _if_left_out(field: inspect.Field) -> str:
    if field.required:
        return "has to be given"
    default = field.default if field.default is not NODEFAULT else field.default_factory()
    return f"`{_value(default)}`"


def _value(value: object) -> str:
    return "nil" if value is None else msgspec.json.encode(value).decode()


def _classes(kinds: Iterable[Any]) -> tuple[Structure, ...]:
    return tuple(dict.fromkeys(cls for kind in kinds for cls in classes_of(kind)))


def _parts(classes: Iterable[Structure]) -> Iterator[inspect.Type]:
    for cls in classes:
        yield from _inner(inspect.type_info(cls))


def _inner(described: inspect.Type) -> Iterator[inspect.Type]:
    """A type and every type inside it."""
    yield described
    match described:
        case inspect.UnionType(types=types) | inspect.TupleType(item_types=types):
            inner = types
        case inspect.StructType(fields=fields):
            inner = tuple(field.type for field in fields)
        case inspect.DictType(key_type=key, value_type=value):
            inner = (key, value)
        case inspect.ListType(item_type=item) | inspect.VarTupleType(item_type=item):
            inner = (item,)
        case _:
            inner = ()
    for each in inner:
        yield from _inner(each)
