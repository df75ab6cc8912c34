"""Values as attributes of a tag."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, cast

import msgspec

from skillwing.bt_missions.xml.node_type import PortError
from skillwing.dsl.model import Type
from skillwing.services.client.inputs import MalformedValueError, read_value


def read(text: str, kind: Type, port: str) -> Any:
    """The value that an attribute stands for: as on the command line, with semicolons between numbers too, or as JSON
    behind `json:`. Raises PortError."""
    text = text.removeprefix("json:").strip()
    if ";" in text and not text.startswith(("[", "{")):
        text = text.replace(";", ",")
    try:
        return read_value(text, kind, port)
    except MalformedValueError as error:
        raise PortError(f"`{port}` is `{text}`; it takes {error}.") from error


def written(value: object) -> str:
    """A value as `read` reads it: plain structures and lists with commas between their values, others as JSON."""
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
            return ",".join(written(part) for part in parts)
        case _:
            return str(value)
