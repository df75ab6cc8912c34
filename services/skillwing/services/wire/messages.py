"""Messages described in Markdown: their fields with types and bounds, as msgspec enforces them; and as JSON Schema."""

from __future__ import annotations

import inspect as python_inspect
from collections.abc import Iterable, Iterator
from enum import Enum
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


def parts_of(classes: Iterable[Structure]) -> tuple[tuple[Structure, ...], tuple[type[Enum], ...]]:
    """The structures inside these messages, and the enumerations, each once and in the order of their appearance."""
    structs: dict[Structure, None] = {}
    enums: dict[type[Enum], None] = {}
    own = tuple(classes)
    for cls in own:
        for part in _inner(inspect.type_info(cls)):
            if isinstance(part, inspect.EnumType):
                enums.setdefault(part.cls)
            elif isinstance(part, inspect.StructType) and part.cls not in own:
                structs.setdefault(part.cls)
    return tuple(structs), tuple(enums)


def link(name: str) -> str:
    """A link to the section of a message or enumeration."""
    return f"[`{name}`](#{name.lower()})"


def links(kind: Any) -> str:
    """Links to all messages that a class or union stands for."""
    return " or ".join(link(cls.__name__) for cls in classes_of(kind))


def section(cls: Structure) -> list[str]:
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


def enumeration(cls: type[Enum]) -> list[str]:
    """The section of an enumeration: what it says, and its values."""
    lines = [f"### {cls.__name__}", ""]
    if cls.__doc__:
        lines += [cls.__doc__, ""]
    return [*lines, f"{', '.join(f'`{member.value}`' for member in cls)}.", ""]


def definitions(classes: Iterable[Structure]) -> dict[str, Any]:
    """These messages and all that is inside them as JSON Schema, by name; `REFERENCE` spells a reference to one."""
    return msgspec.json.schema_components(classes, ref_template=REFERENCE)[1]


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
