"""Did-you-mean: the known name closest to a mistyped one."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from difflib import get_close_matches

STRONG = 0.8
"""A resemblance that is evidence by itself: one wrong letter in a word, such as `sucess` for `success`."""


def closest(name: str, known: Iterable[str], resemblance: float = 0.6) -> str | None:
    """Return the name in `known` that resembles `name` most, or None if none is close.

    Letter case is ignored, since `in_air` for `IN_AIR` is the commonest mistake. resemblance: from 0 for any name to 1
    for the same one.
    """
    candidates = list(dict.fromkeys(known))
    folded = {candidate.casefold(): candidate for candidate in candidates}
    matches = get_close_matches(name.casefold(), folded, n=1, cutoff=resemblance)
    return folded[matches[0]] if matches else None


def did_you_mean(name: str, known: Iterable[str], otherwise: str = ".") -> str:
    """Clause that suggests the name in `known` closest to `name`; `otherwise` if none is close."""
    guess = closest(name, known)
    return f"; did you mean `{guess}`?" if guess else otherwise


def missing_names(lacking: Iterable[str], unknown: Collection[str]) -> list[str]:
    """The names that are missing for certain. Each unknown name may be a misspelt form of one of `lacking`."""
    left = list(lacking)
    for name in unknown:
        near = closest(name, left)
        if near is None:
            return []  # it may stand for any of them
        left.remove(near)
    return left


def listed(names: Iterable[str], limit: int = 12) -> str:
    """A list of names for a sentence: `a`, `b` and `c`. A long list is shortened."""
    quoted = [f"`{name}`" for name in names]
    if not quoted:
        return "none"
    if len(quoted) > limit:
        return ", ".join(quoted[:limit]) + f" and {len(quoted) - limit} more"
    if len(quoted) == 1:
        return quoted[0]
    return ", ".join(quoted[:-1]) + " and " + quoted[-1]
