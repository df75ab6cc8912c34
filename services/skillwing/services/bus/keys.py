"""Key expressions: sets of keys that a subscription, a service or a watch covers.

Skillwing uses a subset of Zenoh's language. `*` stands for exactly one chunk between slashes, `**` for any number of
them, including none.
"""

from __future__ import annotations

from functools import lru_cache


@lru_cache(maxsize=4096)
def matches(expression: str, key: str) -> bool:
    """True if the key expression covers the (wildcard-free) key."""
    return _covers(tuple(expression.split("/")), tuple(key.split("/")))


def _covers(pattern: tuple[str, ...], chunks: tuple[str, ...]) -> bool:
    if not pattern:
        return not chunks
    head, rest = pattern[0], pattern[1:]
    if head == "**":
        return any(_covers(rest, chunks[skipped:]) for skipped in range(len(chunks) + 1))
    return bool(chunks) and head in ("*", chunks[0]) and _covers(rest, chunks[1:])
