"""`BoundedDict`: memory that stays bounded, whatever clients send."""

from __future__ import annotations

from collections.abc import Collection
from typing import Generic, TypeVar

K = TypeVar("K")
V = TypeVar("V")

GOALS_REMEMBERED = 1000
"""Limit for goals of one kind that a process remembers, and for finished goals in each history bucket."""


class BoundedDict(Generic[K, V]):
    """A mapping that keeps the `limit` entries written last."""

    def __init__(self, limit: int) -> None:
        self._limit = limit
        self._entries: dict[K, V] = {}

    def __len__(self) -> int:
        return len(self._entries)

    def __contains__(self, key: K) -> bool:
        return key in self._entries

    def __setitem__(self, key: K, value: V) -> None:
        entries = self._entries
        if key in entries:
            del entries[key]
        elif len(entries) >= self._limit:
            del entries[next(iter(entries))]
        entries[key] = value

    def get(self, key: K) -> V | None:
        return self._entries.get(key)

    def pop(self, key: K) -> V | None:
        """Remove an entry and return its value; None if there is none."""
        return self._entries.pop(key, None)

    def values(self) -> Collection[V]:
        """Live view, the oldest entry first."""
        return self._entries.values()

    def newest(self) -> V | None:
        """The entry written last."""
        return self._entries[next(reversed(self._entries))] if self._entries else None
