"""Options of nodes: what a process table may say, checked."""

from __future__ import annotations

from typing import Any, TypeVar

import msgspec

S = TypeVar("S", bound=msgspec.Struct)


class OptionsError(ValueError):
    """Options that do not fit a node; `str()` says which and why."""


def read_options(options: dict[str, Any], kind: type[S]) -> S:
    """The options as a structure of that kind. Raises OptionsError, which says what is known."""
    try:
        return msgspec.convert(options, kind)
    except msgspec.ValidationError as error:
        known = ", ".join(field.encode_name for field in msgspec.structs.fields(kind))
        raise OptionsError(f"these options do not fit: {error}; known are {known}") from error
