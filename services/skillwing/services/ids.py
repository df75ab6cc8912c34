"""Unique ids of goals and of timeline records."""

from __future__ import annotations

import secrets
import time
import uuid


def new_goal_id() -> str:
    """A UUIDv7 (RFC 9562): unique, and sorted by its time."""
    # Wall time on purpose: robot time starts at zero in each run, and ids must differ between runs.
    milliseconds = time.time_ns() // 1_000_000
    value = (milliseconds & (1 << 48) - 1) << 80 | 0x7 << 76 | secrets.randbits(12) << 64
    value |= 0b10 << 62 | secrets.randbits(62)
    return str(uuid.UUID(int=value))


class RecordIds:
    """Ids of one writer's timeline records: each call returns `<writer>#<n>` with a growing n.

    writer: a unique name, also different from that of a process which this one replaces. n: robot time in milliseconds,
    or the next number within the same millisecond.
    """

    def __init__(self, writer: str) -> None:
        self._writer = writer
        self._last = 0

    def __call__(self, now: float = 0.0) -> str:
        self._last = max(self._last + 1, int(now * 1000))
        return f"{self._writer}#{self._last}"
