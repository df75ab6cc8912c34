"""Names that a misspelt name most likely stands for, so that each mistake is reported once."""

from __future__ import annotations

from collections.abc import Iterable

from skillwing.dsl.suggest import closest


def intended_name(name: str, known: Iterable[str]) -> str | None:
    """The name itself if it is known, else the nearest known name; None if none is near."""
    names = list(known)
    return name if name in names else closest(name, names)
