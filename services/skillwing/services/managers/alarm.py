"""One timer for a moment that keeps moving."""

from __future__ import annotations

from collections.abc import Callable

from skillwing.services.bus import Handle, Timers

SHORTEST_DELAY = 1e-6
"""Seconds. A delay that rounding swallows would ring for ever at the same instant."""


class Alarm:
    """Calls `action` at, or shortly before, the time last set; whoever is called too early sets it again.

    Moving the time later costs nothing, which is what fresh data do many times a second.
    """

    def __init__(self, bus: Timers, action: Callable[[], None]) -> None:
        self._bus = bus
        self._action = action
        self._timer: Handle | None = None
        self._due = 0.0

    def set(self, at: float | None) -> None:
        """Ring at robot time `at`; None for no need to."""
        if at is None or (self._timer is not None and self._due <= at):
            return
        if self._timer is not None:
            self._timer.cancel()
        self._due = at
        self._timer = self._bus.after(max(at - self._bus.now(), SHORTEST_DELAY), self._ring)

    def _ring(self) -> None:
        self._timer = None
        self._action()
