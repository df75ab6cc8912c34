"""Stop signals of a process that runs a system: Ctrl-C, `kill` and a closed terminal.

The first signal is only recorded. An exception from a signal handler may rise anywhere. In a destructor or in a
callback of the import system Python prints and drops it. It may also separate two steps that belong together.
"""

from __future__ import annotations

import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from skillwing.services.bus import RunnableBus

CHECK_PERIOD = 0.2
"""Wall seconds between two checks during a wait."""
SAME_REQUEST = 1.0
"""Wall seconds in which further signals repeat the first one. `timeout` signals the process and its group. `make` and
shells pass on a signal that the terminal has sent already."""


class StopSignal:
    """The request to stop this process. Code that waits checks it with `wait` or `check`.

    clock: wall seconds that never go back.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._received_at: float | None = None
        self._withdrawn_at: float | None = None
        self._raises = False
        self.by_keyboard = False
        """True if the first signal was Ctrl-C, so that a person can be asked."""

    @property
    def received(self) -> bool:
        return self._received_at is not None

    @property
    def was_withdrawn(self) -> bool:
        """True once a person was asked to confirm a Ctrl-C."""
        return self._withdrawn_at is not None

    def receive(self, number: int | None = None) -> None:
        """Record a signal. A new request after the first one raises KeyboardInterrupt at once, wherever the process is.

        The process then ends without its usual last steps. number: of the signal.
        """
        first, now = self._received_at, self._clock()
        repeated = self._withdrawn_at is not None and now - self._withdrawn_at <= SAME_REQUEST
        if repeated and number == signal.SIGINT:
            return
        if first is None:
            self._received_at = now
            self.by_keyboard = number == signal.SIGINT
        if (first is None and self._raises) or (first is not None and now - first > SAME_REQUEST):
            raise KeyboardInterrupt

    def withdraw(self) -> None:
        """Forget a Ctrl-C, because a person has to confirm it. The next signal counts as the first one.

        Repetitions of the forgotten one are ignored.
        """
        self._withdrawn_at, self._received_at = self._clock(), None

    def check(self) -> None:
        """Raise KeyboardInterrupt after a signal."""
        if self.received:
            raise KeyboardInterrupt

    def wait(self, bus: RunnableBus, done: Callable[[], bool], timeout: float) -> bool:
        """Wait as `bus.run_until` does; raises KeyboardInterrupt after a signal."""
        deadline = bus.wall() + timeout
        while True:
            self.check()
            patience = deadline - bus.wall()
            if bus.run_until(lambda: self.received or done(), max(0.0, min(CHECK_PERIOD, patience))):
                self.check()
                return True
            if patience <= 0.0:
                return False

    @contextmanager
    def raising(self) -> Iterator[None]:
        """Let the first signal raise KeyboardInterrupt, in a body that never checks and leaves nothing half done."""
        received_before = self.received
        self._raises = True
        try:
            yield
        finally:
            self._raises = False
        if not received_before:
            self.check()


@contextmanager
def stop_on_signals(clock: Callable[[], float] = time.monotonic) -> Iterator[StopSignal]:
    """Let Ctrl-C, `kill` and a closed terminal stop this process. Under `nohup` a closed terminal does not."""
    stop = StopSignal(clock)
    ends = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    numbers = [number for number in ends if signal.getsignal(number) is not signal.SIG_IGN]
    previous = [signal.signal(number, lambda number, _frame: stop.receive(number)) for number in numbers]
    try:
        yield stop
    finally:
        for number, handler in zip(numbers, previous, strict=True):
            signal.signal(number, handler)
