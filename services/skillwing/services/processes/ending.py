"""How whoever runs a system is told to end: Ctrl-C, `kill`, a closed terminal.

The first signal is only taken note of. An exception out of a signal handler may come up anywhere, also in a destructor
or in a callback of the import system, where Python prints and drops it, and between two steps that belong together.
"""

from __future__ import annotations

import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from skillwing.services.bus import RunnableBus

LOOK_PERIOD = 0.2
"""Wall seconds between two looks while something is waited for."""
ONE_WISH = 1.0
"""Wall seconds in which further signals say the same as the first: `timeout` sends its own to us and to our group, and
`make` and a shell in a pipe pass on what the terminal has sent already."""


class Ending:
    """Whether this process was told to end; those who wait look at it, with `wait` or `look`.

    clock: wall seconds, which never go back.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._told_at: float | None = None
        self._raises = False

    @property
    def told(self) -> bool:
        return self._told_at is not None

    def note(self) -> None:
        """A signal has come. One that is another wish than the first raises KeyboardInterrupt wherever the process is.

        It ends at once then, with what it was about to do at its end left undone.
        """
        first, now = self._told_at, self._clock()
        if first is None:
            self._told_at = now
        if (first is None and self._raises) or (first is not None and now - first > ONE_WISH):
            raise KeyboardInterrupt

    def look(self) -> None:
        """Raise KeyboardInterrupt if the process was told to end."""
        if self.told:
            raise KeyboardInterrupt

    def wait(self, bus: RunnableBus, done: Callable[[], bool], timeout: float) -> bool:
        """Wait as `bus.run_until` does; raises KeyboardInterrupt if the process was told to end."""
        deadline = bus.wall() + timeout
        while True:
            self.look()
            patience = deadline - bus.wall()
            if bus.run_until(lambda: self.told or done(), max(0.0, min(LOOK_PERIOD, patience))):
                self.look()
                return True
            if patience <= 0.0:
                return False

    @contextmanager
    def at_once(self) -> Iterator[None]:
        """Let the first signal raise KeyboardInterrupt in a body that does not look and leaves nothing half done."""
        told_before = self.told
        self._raises = True
        try:
            yield
        finally:
            self._raises = False
        if not told_before:
            self.look()


@contextmanager
def ended_by_signals(clock: Callable[[], float] = time.monotonic) -> Iterator[Ending]:
    """Let Ctrl-C, `kill` and a closed terminal end this process; under `nohup` a closed terminal does not."""
    ending = Ending(clock)
    ends = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    numbers = [number for number in ends if signal.getsignal(number) is not signal.SIG_IGN]
    previous = [signal.signal(number, lambda _number, _frame: ending.note()) for number in numbers]
    try:
        yield ending
    finally:
        for number, handler in zip(numbers, previous, strict=True):
            signal.signal(number, handler)
