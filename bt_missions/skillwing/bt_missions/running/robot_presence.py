"""Presence of the robots of a mission: a robot that cannot be reached makes the leaves about it fail."""

from __future__ import annotations

from collections.abc import Callable

from skillwing.bt_missions.leaves.context import MissionContext
from skillwing.services.bus import Bus, Handle
from skillwing.services.names import CLIENT, MISSION
from skillwing.services.protocol import Keys

LOST_AFTER = 5.0
"""Seconds of wall time for which all processes of a robot may be away. Restarted ones are back earlier."""


class RobotPresence:
    """Watch of one robot's processes. It sets the `absence` of the robot's context, and calls `on_change`.

    A robot without its resource manager is there: what it has granted goes on for a while. connected: False while the
    mission itself hears nobody. Then it judges no robot, and has `LOST_AFTER` again after the return.
    """

    def __init__(
        self,
        bus: Bus,
        keys: Keys,
        context: MissionContext,
        on_change: Callable[[], None],
        connected: Callable[[], bool],
    ) -> None:
        self._bus = bus
        self._context = context
        self._on_change = on_change
        self._connected = connected
        self._hears_nobody = False
        self._prefix = keys.alive("")
        self._present: set[str] = set()
        self._timer: Handle | None = None
        self._watch = bus.watch_alive(keys.alive("**"), self._note)

    def cancel(self) -> None:
        self._watch.cancel()
        self._stop_timer()

    def _note(self, key: str, alive: bool) -> None:
        name = key.removeprefix(self._prefix)
        if name == MISSION or name.startswith(CLIENT):
            return
        (self._present.add if alive else self._present.discard)(name)
        self._stop_timer()
        if not self._present:
            self._hears_nobody = not self._connected()
            self._timer = self._bus.after(LOST_AFTER, self._lose, wall=True)
        elif self._context.absence:
            self._context.absence = ""
            self._on_change()

    def _stop_timer(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _lose(self) -> None:
        heard_nobody, self._hears_nobody = self._hears_nobody, not self._connected()
        if heard_nobody or self._hears_nobody:
            self._timer = self._bus.after(LOST_AFTER, self._lose, wall=True)
            return
        self._context.absence = f"none of its processes is heard for {LOST_AFTER:g} s"
        self._on_change()
