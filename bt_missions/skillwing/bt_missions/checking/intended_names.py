"""Names that a misspelt name most likely stands for. Each mistake is then reported once."""

from __future__ import annotations

from collections.abc import Collection, Iterable

from skillwing.dsl.suggest import closest


def intended_name(name: str, known: Iterable[str]) -> str | None:
    """The name itself where it is known, else the nearest one; None where nobody can tell."""
    names = list(known)
    return name if name in names else closest(name, names)


def missing_names(lacking: Iterable[str], strangers: Collection[str]) -> list[str]:
    """What really lacks. strangers: names that are not known, each of which may be one of those that lack, misspelt."""
    left = list(lacking)
    for stranger in strangers:
        near = closest(stranger, left)
        if near is None:
            return []  # it may stand for any of them
        left.remove(near)
    return left
