"""Robot time that stands still, by which no deadline of robot time will ever pass."""

from __future__ import annotations

from collections.abc import Callable

from skillwing.services.bus import Bus, Handle

CLOCK_TIMEOUT = 15.0
"""How long robot time may stand still during a flight, in seconds of wall time."""


class ClockWatchdog:
    """Calls `on_still` when robot time has stood still for so long. It looks until it is cancelled."""

    def __init__(self, bus: Bus, on_still: Callable[[], None]) -> None:
        self._bus = bus
        self._on_still = on_still
        self._look_after(bus.now())

    def cancel(self) -> None:
        self._handle.cancel()

    def _look_after(self, seen: float) -> None:
        self._handle: Handle = self._bus.after(CLOCK_TIMEOUT, lambda: self._look(seen), wall=True)

    def _look(self, seen: float) -> None:
        now = self._bus.now()
        if now > seen:
            self._look_after(now)
        else:
            self._on_still()
