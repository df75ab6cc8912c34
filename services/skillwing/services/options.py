"""Options of a process: required texts, and names of Python objects."""

from __future__ import annotations

from importlib import import_module
from typing import Any, TypeVar

import msgspec

from skillwing.services.errors import InvalidOptionError
from skillwing.services.user_code_errors import load_error_message

S = TypeVar("S", bound=msgspec.Struct)


class OptionsError(ValueError):
    """Options that do not fit a node."""


def read_options(options: dict[str, Any], kind: type[S]) -> S:
    """The options as a structure of that kind. Raises OptionsError, which names the known options."""
    try:
        return msgspec.convert(options, kind)
    except msgspec.ValidationError as error:
        known = ", ".join(field.encode_name for field in msgspec.structs.fields(kind))
        raise OptionsError(f"these options do not fit: {error}; known are {known}") from error


def required(options: dict[str, Any], name: str) -> str:
    """The text of an option. Raises InvalidOptionError without it."""
    value = options.get(name)
    if not isinstance(value, str) or not value:
        given = ", ".join(f"`{key}`" for key in options) or "none"
        raise InvalidOptionError(name, f"The option `{name}` is missing. Give it as text; given: {given}.")
    return value


def imported(options: dict[str, Any], name: str) -> Any:
    """The object that an option names as `package.module:attribute`. Raises InvalidOptionError.

    Its text differs for a module that is missing and for one that cannot be loaded.
    """
    path = required(options, name)
    module, colon, attribute = path.partition(":")
    if not (colon and attribute and all(part.isidentifier() for part in module.split("."))):
        text = f"The option `{name}` is `{path}`. Write `package.module:attribute`."
        raise InvalidOptionError(name, text)
    try:
        found = import_module(module)
    except (Exception, SystemExit) as error:  # a user's code may fail in any way
        text = load_error_message(module, error)
        raise InvalidOptionError(name, f"The option `{name}` names `{path}`, but {text}") from error
    try:
        return getattr(found, attribute)
    except AttributeError as error:
        text = f"`{module}` has no `{attribute}`. Name something that it defines."
        raise InvalidOptionError(name, f"The option `{name}` names `{path}`, but {text}") from error
