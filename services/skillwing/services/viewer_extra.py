"""Modules that need the packages of the extra `viewer`, which a robot need not have."""

from __future__ import annotations

from importlib import import_module
from types import ModuleType

from skillwing.services.errors import InvalidOptionError


def viewer_module(name: str, option: str) -> ModuleType:
    """The module `name` of a folder that draws or records.

    Raises InvalidOptionError, about the option that asked for it, if the packages are not installed.
    """
    try:
        return import_module(name)
    except ModuleNotFoundError as missing:
        text = f"{missing.name} is not installed. To draw a run: pip install 'skillwing[viewer]'."
        raise InvalidOptionError(option, text) from missing
