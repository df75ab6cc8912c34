"""Conversion of values to attributes of a tag, and back."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, cast

import msgspec

from skillwing.bt_missions.leaves.blackboard_entry import BlackboardEntry
from skillwing.bt_missions.leaves.readings import LatestReading
from skillwing.bt_missions.xml.node_type import DATA, PortError
from skillwing.dsl.model import ArrayType, StructType, Type
from skillwing.services.client.inputs import MalformedValueError, read_value
from skillwing.services.core.values import fit


def read_attribute(text: str, kind: Type, port: str) -> Any:
    """The value of an attribute: as on the command line, with semicolons between numbers too, or JSON after `json:`.

    Raises PortError.
    """
    text = text.removeprefix("json:").strip()
    if ";" in text and not text.startswith(("[", "{")):
        text = text.replace(";", ",")
    try:
        return read_value(text, kind, port)
    except MalformedValueError as error:
        raise PortError(f"`{port}` is `{text}`; it takes {error}.") from error


def read_option(value: object, kind: Type, name: str) -> Any:
    """The value of an option, from a plain one: text, a list of texts, a list of such lists, or a value of JSON.

    Raises PortError.
    """
    fitted, problems = fit(_typed(value, kind, name), kind, name)
    if problems:
        raise PortError(" ".join(problem.sentence for problem in problems))
    return fitted


def _typed(value: object, kind: Type, name: str) -> Any:
    if isinstance(value, str):
        return read_attribute(value, kind, name)
    if not isinstance(value, list):
        return value
    parts = cast("list[object]", value)
    if isinstance(kind, ArrayType) and any(isinstance(part, list) for part in parts):
        return [_typed(part, kind.element, name) for part in parts]
    if any(isinstance(part, list | dict) for part in parts):
        return parts
    if isinstance(kind, ArrayType) and isinstance(kind.element, StructType) and parts:
        return [_typed(parts, kind.element, name)]
    return read_attribute(",".join(map(attribute_text, parts)), kind, name)


def reference_text(value: object) -> str | None:
    """The text of an entry, or of a reading of the robot: `{name}`, `{data.name}`. None for another value."""
    match value:
        case BlackboardEntry():
            return f"{{{value.name}}}"
        case LatestReading():
            return f"{{{DATA}{value.path}}}"
        case _:
            return None


def attribute_text(value: object) -> str:
    """A value as `read_attribute` reads it: commas between the values of structures and lists, else JSON."""
    match value:
        case bool():
            return "true" if value else "false"
        case float():
            return repr(value).removesuffix(".0")
        case Mapping() | list() | tuple():
            items = cast("Mapping[str, object] | list[object]", value)
            parts = list(items.values() if isinstance(items, Mapping) else items)
            if any(isinstance(part, Mapping | list | tuple) for part in parts):
                return f"json:{msgspec.json.encode(value).decode()}"
            return ",".join(attribute_text(part) for part in parts)
        case _:
            return str(value)
