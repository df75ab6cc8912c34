"""A timer for a time that often moves."""

from __future__ import annotations

from collections.abc import Callable

from skillwing.services.bus import Handle, Timers

SHORTEST_DELAY = 1e-6
"""Seconds. A shorter delay is lost by rounding, and the timer fires for ever at the same time."""


class Alarm:
    """A timer that calls `action` at the time last set, or earlier; the action then sets it again.

    To move the time later costs nothing. Fresh data do so many times a second.
    """

    def __init__(self, bus: Timers, action: Callable[[], None]) -> None:
        self._bus = bus
        self._action = action
        self._timer: Handle | None = None
        self._due = 0.0

    def set(self, at: float | None) -> None:
        """Call the action at robot time `at`; None changes nothing."""
        if at is None or (self._timer is not None and self._due <= at):
            return
        if self._timer is not None:
            self._timer.cancel()
        self._due = at
        self._timer = self._bus.after(max(at - self._bus.now(), SHORTEST_DELAY), self._fire)

    def _fire(self) -> None:
        self._timer = None
        self._action()
