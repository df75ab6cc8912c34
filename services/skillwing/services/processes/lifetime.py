"""Lifetime of a process: it ends on SIGTERM or SIGINT, or when its parent is gone."""

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
"""Exit code: no router answers at the given address, or the router's port is taken."""
EXIT_CRASHED = 70
"""Exit code: an unexpected exception; the log has its traceback."""
EXIT_PASSING = 74
"""Exit code: a file cannot be read or written now, or another robot is busy or silent. Another attempt may succeed."""
EXIT_REPLACED = 76
"""Exit code: a successor of the same name has replaced this process."""
EXIT_CONFIGURATION = 78
"""Exit code: the options of the process are wrong; it has printed which."""
EXIT_ORPHANED = 75
"""Exit code: the parent is gone, and the process did not end in time."""
ORPHAN_GRACE = 5.0
"""Longest time for an orderly end after the parent is gone [s]."""


class Lifetime:
    """Handler of the signals that end a process. Make it once, on the main thread, before any long operation.

    parent_pipe: also end when standard input closes. A killed parent cannot signal, but its end of the pipe closes.
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
        """Ask the process to end. Any thread may call it, more than once."""
        self.over = True
        self._end.put(None)
        for wake in tuple(self._wakes):
            wake()

    def on_end(self, wake: Callable[[], None]) -> None:
        """Call `wake` at the end, too, on the thread that notices it."""
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
        # A callback that hangs does not notice. No parent is left to kill the process, so it exits by itself.
        time.sleep(ORPHAN_GRACE)
        os._exit(EXIT_ORPHANED)
