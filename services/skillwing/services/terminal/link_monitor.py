"""The link of a command to its robot: a sentence when the robot's router falls silent, and one when it answers again.

`LinkMonitor` is pure; `follow_link` feeds it on a bus.
"""

from __future__ import annotations

from collections.abc import Callable
from datetime import datetime

from skillwing.services.bus import Bus
from skillwing.services.client.connection import Target
from skillwing.services.terminal.connection import System

LOOK_PERIOD = 0.25
"""Wall time in seconds between two looks at the link. Zenoh notices a silent router after its lease of 2 s."""
ON_BOARD = "A mission on board goes on."
TIME = "%H:%M:%S"


class LinkMonitor:
    """Sentences about one link. endpoint: address of the router. meanwhile: what the robot does without it."""

    def __init__(self, endpoint: str, meanwhile: str = "") -> None:
        self._endpoint = endpoint
        self._meanwhile = meanwhile
        self._since: float | None = None
        self.warning = ""
        """The sentence about a link that is away now; empty otherwise."""

    def update(self, *, connected: bool, now: float, clock: str) -> str:
        """The sentence about a change of the link; empty without one.

        now: wall time in seconds from any origin. clock: the same time for people.
        """
        if not connected and self._since is None:
            self._since = now
            self.warning = f"{self._endpoint} has not answered since {clock}. {self._meanwhile}".rstrip()
            return self.warning
        if connected and self._since is not None:
            seconds, self._since, self.warning = now - self._since, None, ""
            return f"{self._endpoint} answers again at {clock}, after {seconds:.0f} s."
        return ""


def follow_link(system: System, say: Callable[[str], None], meanwhile: str | None = None) -> LinkMonitor:
    """Report each change of the link while the system's bus runs.

    meanwhile: what the robot does without the link, by default for a station that does not know who commands it.
    """
    bus = system.bus
    monitor = LinkMonitor(system.target.endpoint, unattended_text(system.target) if meanwhile is None else meanwhile)

    def look() -> None:
        sentence = look_at_link(monitor, bus, connected=bus.connected)
        if sentence:
            say(sentence)
        bus.after(LOOK_PERIOD, look, wall=True)

    look()
    return monitor


def look_at_link(monitor: LinkMonitor, bus: Bus, *, connected: bool) -> str:
    """The sentence about a change of the link at this moment; empty without one."""
    return monitor.update(connected=connected, now=bus.wall(), clock=f"{datetime.now().astimezone():{TIME}}")


def unattended_text(target: Target) -> str:
    """Sentences on a robot without a link, for a station that does not know whether a mission on board commands it."""
    return f"{ON_BOARD} {target.without_goals}".rstrip()
