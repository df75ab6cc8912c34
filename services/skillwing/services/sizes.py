"""Sizes and ages in words: `10GB`, `30d`."""

from __future__ import annotations

import re

_UNITS = {"B": 1, "kB": 1_000, "MB": 1_000_000, "GB": 1_000_000_000, "TB": 1_000_000_000_000}
_AGES = {"h": 3600.0, "d": 86400.0, "w": 604800.0}


def read_size(text: str) -> int:
    """The bytes of a size such as `10GB`. Raises ValueError with the accepted forms."""
    units = {unit.lower(): factor for unit, factor in _UNITS.items()}
    found = re.fullmatch(r"(\d+(?:\.\d+)?)\s*([a-z]+)", text.strip().lower())
    if found is None or found[2] not in units:
        raise ValueError("write a number and one of kB, MB, GB and TB, such as 10GB")
    return int(float(found[1]) * units[found[2]])


def size_text(size: float) -> str:
    """A size in words: `9.5 GB`."""
    unit, factor = next(((unit, factor) for unit, factor in reversed(_UNITS.items()) if size >= factor), ("B", 1))
    number = size / factor
    return f"{number:.0f} {unit}" if number >= 100 or number == int(number) else f"{number:.1f} {unit}"


def size_words(size: int) -> str:
    """A size in the form that `read_size` accepts, without loss."""
    return f"{size}B"


def read_age(text: str) -> float:
    """The seconds of an age such as `30d`. Raises ValueError with the accepted forms."""
    found = re.fullmatch(r"(\d+(?:\.\d+)?)\s*([hdw])", text.strip().lower())
    if found is None:
        raise ValueError("write a number and h, d or w: hours, days or weeks, such as 30d")
    return float(found[1]) * _AGES[found[2]]
