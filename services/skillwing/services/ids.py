"""Names that never repeat: ids of goals and of timeline records."""

from __future__ import annotations

import secrets
import time
import uuid
from itertools import count


def new_goal_id() -> str:
    """A UUIDv7 (RFC 9562): sorts by the time of its making, and nobody else will draw the same one."""
    # Wall time on purpose: an id has to differ between two runs in which robot time starts at zero again.
    milliseconds = time.time_ns() // 1_000_000
    value = (milliseconds & (1 << 48) - 1) << 80 | 0x7 << 76 | secrets.randbits(12) << 64
    value |= 0b10 << 62 | secrets.randbits(62)
    return str(uuid.UUID(int=value))


class RecordIds:
    """Calls return `<process>#1`, `<process>#2`, ...: ids of the timeline records that one process writes."""

    def __init__(self, process: str) -> None:
        self._process = process
        self._numbers = count(1)

    def __call__(self) -> str:
        return f"{self._process}#{next(self._numbers)}"
