"""The mailbox of a node: actions that any thread hands to the node's own."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from contextlib import suppress
from threading import Lock


class Mailbox:
    """Actions that wait for one thread, oldest first. Any thread may put one in, and so may a signal handler.

    `queue.SimpleQueue` does not serve: with a timeout, its `get` may wait for ever. After a `get_nowait` it looks at
    the clock twice, and a thread that is delayed in between waits for a negative time (CPython 3.11).
    """

    def __init__(self) -> None:
        self._actions: deque[Callable[[], None]] = deque()
        self._silent = Lock()
        """Held until there is something new. It may be free without anything new, never the reverse."""
        self._silent.acquire()

    def __len__(self) -> int:
        return len(self._actions)

    def put(self, action: Callable[[], None]) -> None:
        """Let an action wait."""
        self._actions.append(action)
        if self._silent.locked():
            with suppress(RuntimeError):  # another thread has put something in at the same moment
                self._silent.release()

    def take(self) -> Callable[[], None]:
        """Take the oldest action. Raises IndexError without one."""
        return self._actions.popleft()

    def wait(self, timeout: float | None) -> bool:
        """Wait for an action; True if there is one. Only the node's thread calls this.

        timeout: wall seconds, at least 0; None waits as long as it takes. It may return False earlier.
        """
        self._silent.acquire(blocking=False)
        if not self._actions:
            self._silent.acquire(timeout=-1.0 if timeout is None else timeout)
        return bool(self._actions)
