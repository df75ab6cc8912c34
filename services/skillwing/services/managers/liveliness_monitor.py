"""Processes that come and go, known by their alive tokens: gone is who stays away, not whose token flaps."""

from __future__ import annotations

from collections.abc import Callable

from skillwing.services.bus import Bus
from skillwing.services.core.leases import Expired
from skillwing.services.managers.lease_watch import LeaseWatch
from skillwing.services.protocol import Keys

LOSS_DEBOUNCE = 1.0
"""Wall time in seconds for which an alive token has to be away: a healing network lets tokens flap."""


class LivelinessMonitor:
    """Watches the alive tokens of `processes`, a key expression such as `**`.

    on_gone gets the name of each process whose token was away for a second while we were connected. from_outside: they
    are clients of the router also where we are not, so that the second passes only while there is one.
    """

    def __init__(
        self, bus: Bus, keys: Keys, processes: str, on_gone: Callable[[str], None], *, from_outside: bool = False
    ) -> None:
        self._prefix = keys.alive("")
        self._on_gone = on_gone
        self._here: set[str] = set()
        self._absences = LeaseWatch(bus, self._on_expired, from_outside=from_outside)
        bus.watch_alive(keys.alive(processes), self._on_alive)

    def expect(self, process: str) -> None:
        """Count a process that has not been seen yet as gone, unless its token shows up within the second."""
        if process not in self._here and process not in self._absences:
            self._absences.begin(process, LOSS_DEBOUNCE)

    def _on_alive(self, key: str, alive: bool) -> None:
        process = key.removeprefix(self._prefix)
        if alive:
            self._here.add(process)
            self._absences.end(process)
        else:
            self._here.discard(process)
            self._absences.begin(process, LOSS_DEBOUNCE)

    def _on_expired(self, absence: Expired) -> None:
        self._on_gone(absence.key)
