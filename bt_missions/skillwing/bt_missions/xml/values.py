"""Conversion of values to attributes of a tag, and back."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, cast

import msgspec

from skillwing.bt_missions.xml.node_type import PortError
from skillwing.dsl.model import Type
from skillwing.services.client.inputs import MalformedValueError, read_value


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
