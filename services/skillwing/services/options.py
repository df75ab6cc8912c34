"""Reading the options that a process was started with."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from skillwing.services.errors import InvalidOptionError


def required(options: dict[str, Any], name: str) -> str:
    """The text of an option. Raises InvalidOptionError where it is missing."""
    value = options.get(name)
    if not isinstance(value, str) or not value:
        given = ", ".join(f"`{key}`" for key in options) or "none"
        raise InvalidOptionError(name, f"The option `{name}` is missing. Give it as text; there is {given}.")
    return value


def imported(options: dict[str, Any], name: str) -> Any:
    """What an option of the form `package.module:attribute` names. Raises InvalidOptionError."""
    path = required(options, name)
    module, _, attribute = path.partition(":")
    try:
        return getattr(import_module(module), attribute)
    except (ImportError, AttributeError, ValueError) as error:
        text = f"The option `{name}` names `{path}`, which cannot be had: {error}. Write `package.module:attribute`."
        raise InvalidOptionError(name, text) from error
