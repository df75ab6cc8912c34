"""Robot time that stands still."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from skillwing.services.bus import Bus, Handle


class BusInStandingTime:
    """A bus whose robot time stands still: its timers never end, and those of wall time do."""

    def __init__(self, bus: Bus) -> None:
        self._bus = bus

    def __getattr__(self, name: str) -> Any:
        return getattr(self._bus, name)

    def after(self, delay: float, action: Callable[[], None], *, wall: bool = False) -> Handle:
        return self._bus.after(delay, action if wall else lambda: None, wall=True)
