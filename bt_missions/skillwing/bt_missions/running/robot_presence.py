"""Presence of the robots of a mission: a robot that cannot be reached makes the leaves about it fail."""

from __future__ import annotations

from collections.abc import Callable

from skillwing.bt_missions.leaves.context import MissionContext
from skillwing.services.bus import Bus, Handle
from skillwing.services.names import RESOURCE_MANAGER
from skillwing.services.protocol import Keys

LOST_AFTER = 5.0
"""Seconds of wall time for which a resource manager may be away. One that was killed is back earlier."""


class RobotPresence:
    """Watch of one robot's resource manager. It sets the `absence` of the robot's context, and calls `on_change`."""

    def __init__(self, bus: Bus, keys: Keys, context: MissionContext, on_change: Callable[[], None]) -> None:
        self._bus = bus
        self._context = context
        self._on_change = on_change
        self._timer: Handle | None = None
        self._watch = bus.watch_alive(keys.alive(RESOURCE_MANAGER), self._note)

    def cancel(self) -> None:
        self._watch.cancel()
        if self._timer is not None:
            self._timer.cancel()

    def _note(self, _key: str, alive: bool) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        if not alive:
            self._timer = self._bus.after(LOST_AFTER, self._lose, wall=True)
        elif self._context.absence:
            self._context.absence = ""
            self._on_change()

    def _lose(self) -> None:
        self._context.absence = f"its resource manager is away for {LOST_AFTER:g} s"
        self._on_change()
