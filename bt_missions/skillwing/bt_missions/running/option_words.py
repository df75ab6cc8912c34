"""Options of a mission as they are typed: `speed=1.5`, `route=30,0,4; 30,20,4`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import msgspec

from skillwing.services.errors import InvalidOptionError


def parse_options(words: Sequence[str]) -> dict[str, Any]:
    """The options that words of the form NAME=VALUE give.

    Commas separate the values of a list and semicolons the lists of a list; anything else may be written as JSON. What
    a value has to be is for the mission to say. Raises InvalidOptionError.
    """
    options: dict[str, Any] = {}
    for word in words:
        name, equals, text = word.partition("=")
        if not equals or not name:
            raise InvalidOptionError(word, f"`{word}` is not of the form NAME=VALUE.")
        if name in options:
            raise InvalidOptionError(name, f"`{name}` is given twice; give it once.")
        options[name] = plain_value(name, text.strip())
    return options


def plain_value(name: str, text: str) -> Any:
    """The value of one option as it is typed: text, a list of texts, a list of such lists, or what JSON says."""
    if text.startswith(("[", "{")):
        try:
            return msgspec.json.decode(text)
        except msgspec.DecodeError as error:
            raise InvalidOptionError(name, f"`{name}` looks like JSON and is not: {error}.") from error
    if ";" in text:
        return [_values(part) for part in text.split(";") if part.strip()]
    return _values(text) if "," in text else text


def _values(text: str) -> list[str]:
    return [part.strip() for part in text.split(",")]
