"""Options of nodes, checked."""

from __future__ import annotations

from typing import Any, Literal, TypeVar

import msgspec

S = TypeVar("S", bound=msgspec.Struct)
Poses = Literal["odometry", "navigation", "small-gicp"]
"""Sources of the map's poses (docs/mapping.md)."""


class OptionsError(ValueError):
    """Options that do not fit a node; `str()` says which and why."""


def read_options(options: dict[str, Any], kind: type[S]) -> S:
    """The options as a structure of that kind. Raises OptionsError, which says what is known."""
    try:
        return msgspec.convert(options, kind)
    except msgspec.ValidationError as error:
        known = ", ".join(field.encode_name for field in msgspec.structs.fields(kind))
        raise OptionsError(f"these options do not fit: {error}; known are {known}") from error
