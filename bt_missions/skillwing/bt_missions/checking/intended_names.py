"""Names that a misspelt name most likely stands for, so that each mistake is reported once."""

from __future__ import annotations

from collections.abc import Collection, Iterable

from skillwing.dsl.suggest import closest


def intended_name(name: str, known: Iterable[str]) -> str | None:
    """The name itself if it is known, else the nearest known name; None if none is near."""
    names = list(known)
    return name if name in names else closest(name, names)


def missing_names(lacking: Iterable[str], unknown: Collection[str]) -> list[str]:
    """The names that are missing for certain. Each unknown name may be a misspelt form of one of `lacking`."""
    left = list(lacking)
    for name in unknown:
        near = closest(name, left)
        if near is None:
            return []  # it may stand for any of them
        left.remove(near)
    return left
