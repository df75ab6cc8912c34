"""Wait of a mission while its own link to the robot is away."""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum, auto

from skillwing.services.bus import Bus, Handle

LOOK_PERIOD = 0.25
"""Wall time in seconds between two looks at the link."""
RECOVERY = 1.5
"""Wall time in seconds from the return of the link to the next tick: until then statuses and data arrive that were
missed, and data with a period of 1 s."""


WITHOUT_GRACE = 60.0
"""Wall time in seconds until a mission without a grace ends. The link may return earlier, in time for its rescue."""


class Link(Enum):
    """UP: ticks go on. AWAY: the mission waits. OVER: the link was away for the whole grace, or for too long."""

    UP = auto()
    AWAY = auto()
    OVER = auto()


class LinkPatience:
    """Judgement of a link by looks at it. grace: longest wait in seconds; with 0 the mission does not wait."""

    def __init__(self, grace: float) -> None:
        self._waits = grace > 0.0
        self.limit = grace or WITHOUT_GRACE
        """Seconds without the link after which the mission is over."""
        self._lost_at: float | None = None
        self._back_at: float | None = None

    def look(self, *, connected: bool, now: float) -> Link:
        """State of the link at a wall time [s]."""
        if not connected:
            self._back_at = None
            self._lost_at = now if self._lost_at is None else self._lost_at
            if now - self._lost_at >= self.limit:
                return Link.OVER
            return Link.AWAY if self._waits else Link.UP
        if self._lost_at is None or not self._waits:
            self._lost_at = None
            return Link.UP
        self._back_at = now if self._back_at is None else self._back_at
        if now - self._back_at < RECOVERY:
            return Link.AWAY
        self._lost_at = self._back_at = None
        return Link.UP


class LinkWait:
    """Shell of `LinkPatience` on the mission's bus. Call `begin` when the mission begins to run.

    connected: the state of the link, by default that of the bus; of several robots any is enough.
    """

    def __init__(self, bus: Bus, grace: float, connected: Callable[[], bool] | None = None) -> None:
        self._bus = bus
        self._connected = connected or (lambda: bus.connected)
        self._patience = LinkPatience(grace)
        self.limit = self._patience.limit
        self._state = Link.UP
        self._timer: Handle | None = None

    @property
    def is_away(self) -> bool:
        """True while the mission has to wait."""
        return self._state is not Link.UP

    def begin(self, on_back: Callable[[], None], on_over: Callable[[], None]) -> Handle:
        """Look at the link from now on. on_back: the mission can go on. on_over: it cannot, after its limit."""

        def look() -> None:
            before, self._state = self._state, self._patience.look(connected=self._connected(), now=self._bus.wall())
            if self._state is Link.OVER:
                on_over()
                return
            if before is Link.AWAY and self._state is Link.UP:
                on_back()
            self._timer = self._bus.after(LOOK_PERIOD, look, wall=True)

        look()
        return self

    def cancel(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
