"""Reading the options that a process was started with."""

from __future__ import annotations

from importlib import import_module
from typing import Any, TypeVar

import msgspec

from skillwing.services.errors import InvalidOptionError
from skillwing.services.failing_code import load_failure

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
    """The text of an option. Raises InvalidOptionError where it is missing."""
    value = options.get(name)
    if not isinstance(value, str) or not value:
        given = ", ".join(f"`{key}`" for key in options) or "none"
        raise InvalidOptionError(name, f"The option `{name}` is missing. Give it as text; there is {given}.")
    return value


def imported(options: dict[str, Any], name: str) -> Any:
    """What an option of the form `package.module:attribute` names. Raises InvalidOptionError.

    That the module is not there is told apart from a module that is, and cannot be loaded.
    """
    path = required(options, name)
    module, colon, attribute = path.partition(":")
    if not (colon and attribute and all(part.isidentifier() for part in module.split("."))):
        text = f"The option `{name}` is `{path}`. Write `package.module:attribute`."
        raise InvalidOptionError(name, text)
    try:
        found = import_module(module)
    except (Exception, SystemExit) as error:  # what somebody else writes may fail in any way
        told = load_failure(module, error)
        raise InvalidOptionError(name, f"The option `{name}` names `{path}`, but {told}") from error
    try:
        return getattr(found, attribute)
    except AttributeError as error:
        told = f"`{module}` has no `{attribute}`. Name something that it defines"
        raise InvalidOptionError(name, f"The option `{name}` names `{path}`, but {told}.") from error
