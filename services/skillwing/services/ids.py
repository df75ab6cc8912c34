"""Names that never repeat: ids of goals and of timeline records."""

from __future__ import annotations

import secrets
import time
import uuid


def new_goal_id() -> str:
    """A UUIDv7 (RFC 9562): sorts by the time of its making, and nobody else will draw the same one."""
    # Wall time on purpose: an id has to differ between two runs in which robot time starts at zero again.
    milliseconds = time.time_ns() // 1_000_000
    value = (milliseconds & (1 << 48) - 1) << 80 | 0x7 << 76 | secrets.randbits(12) << 64
    value |= 0b10 << 62 | secrets.randbits(62)
    return str(uuid.UUID(int=value))


class RecordIds:
    """Calls return `<writer>#<n>` with a growing n: ids of the timeline records that one writer writes.

    writer: nobody else's name, also not that of another process in whose place this one stands. n is the robot time in
    milliseconds or, within the same one, the next number.
    """

    def __init__(self, writer: str) -> None:
        self._writer = writer
        self._last = 0

    def __call__(self, now: float = 0.0) -> str:
        self._last = max(self._last + 1, int(now * 1000))
        return f"{self._writer}#{self._last}"
