"""How many requests may wait for a node that is busy: so many, and no more, whoever asks."""

from __future__ import annotations

import threading

MOST_REQUESTS = 1000
MOST_BYTES = 32 * 2**20


class Backlog:
    """The requests that have come in for a node and that it has not taken up yet. For any thread.

    Only requests are counted: who asks is answered that there is no room, and asks again. Answers and events were asked
    for, nobody would say them again, and so they always find room.
    """

    def __init__(self, most_requests: int = MOST_REQUESTS, most_bytes: int = MOST_BYTES) -> None:
        self._most_requests = most_requests
        self._most_bytes = most_bytes
        self._requests = 0
        self._bytes = 0
        self._lock = threading.Lock()

    def enter(self, size: int) -> bool:
        """Let a request of `size` bytes wait. False if there is no room; one always has room where none waits."""
        with self._lock:
            full = self._requests >= self._most_requests or self._bytes + size > self._most_bytes
            if full and self._requests:
                return False
            self._requests += 1
            self._bytes += size
            return True

    def leave(self, size: int) -> None:
        """The node takes up a request that was let in."""
        with self._lock:
            self._requests -= 1
            self._bytes -= size
