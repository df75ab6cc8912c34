"""When a process has to end: on SIGTERM or SIGINT, or when the process that started it is gone."""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from collections.abc import Callable
from queue import SimpleQueue

EXIT_OK = 0
EXIT_UNREACHABLE = 69
"""There is no router where the process was told to look for one, or the router's port is taken."""
EXIT_CRASHED = 70
"""An exception that nobody expected; the log has its traceback."""
EXIT_PASSING = 74
"""What it needs cannot be read or written just now; the next one may be luckier."""
EXIT_REPLACED = 76
"""Another process of its name has taken its place."""
EXIT_CONFIGURATION = 78
"""The process was told to do something it cannot; it said what."""
EXIT_ORPHANED = 75
"""Its parent was gone, and it did not come to its end in time."""
ORPHAN_GRACE = 5.0
"""Seconds that an orphan has for its end in good order."""


class Lifetime:
    """Takes over the ends of a process; to be made on its main thread, once, before anything that takes time.

    A parent that is killed cannot tell anyone, but its end of the pipe to our standard input closes with it.
    """

    def __init__(self, *, parent_pipe: bool) -> None:
        self.over = False
        self._end: SimpleQueue[None] = SimpleQueue()
        self._wakes: list[Callable[[], None]] = []
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, lambda _number, _frame: self.end())
        if parent_pipe:
            threading.Thread(target=self._follow_parent, name="parent", daemon=True).start()

    def end(self) -> None:
        """The process has to end. May be called on any thread, more than once."""
        self.over = True
        self._end.put(None)
        for wake in tuple(self._wakes):
            wake()

    def on_end(self, wake: Callable[[], None]) -> None:
        """Have `wake` called at the end, besides whatever else is, on whatever thread notices it."""
        self._wakes.append(wake)
        if self.over:
            wake()

    def wait(self) -> None:
        """Block until the end."""
        if not self.over:
            self._end.get()

    def _follow_parent(self) -> None:
        # A plain read on the descriptor: at exit, Python must not find a thread holding the lock of sys.stdin.
        while os.read(sys.stdin.fileno(), 4096):
            pass
        self.end()
        # Whoever hangs in a callback does not notice. Nobody is left to kill it, so it does that itself.
        time.sleep(ORPHAN_GRACE)
        os._exit(EXIT_ORPHANED)
