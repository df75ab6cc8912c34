"""Liveliness of processes, by their alive tokens: a process is gone if its token stays away."""

from __future__ import annotations

from collections.abc import Callable

from skillwing.services.bus import Bus
from skillwing.services.core.leases import Expired
from skillwing.services.managers.lease_watch import LeaseWatch
from skillwing.services.protocol import Keys

LOSS_DEBOUNCE = 1.0
"""Wall time in seconds for which an alive token has to be away: tokens flap while a network heals."""


class LivelinessMonitor:
    """Watches the alive tokens of `processes`, a key expression such as `**`.

    on_gone gets the name of each process whose token was away for a second while this process was connected.
    from_outside: the processes are clients that only the router connects to this one. Then the second passes only
    while there is a router. grace: seconds beyond the first for which the token of a process may be away.
    """

    def __init__(
        self,
        bus: Bus,
        keys: Keys,
        processes: str,
        on_gone: Callable[[str], None],
        *,
        from_outside: bool = False,
        grace: Callable[[str], float] = lambda process: 0.0,
    ) -> None:
        self._prefix = keys.alive("")
        self._on_gone = on_gone
        self._grace = grace
        self._here: set[str] = set()
        self._absences = LeaseWatch(bus, self._on_expired, from_outside=from_outside)
        bus.watch_alive(keys.alive(processes), self._on_alive)

    def expect(self, process: str) -> None:
        """Count a process that was never seen as gone, unless its token shows up within its time.

        If its token has just vanished, its grace of now counts.
        """
        if process in self._absences:
            self._absences.extend(process, LOSS_DEBOUNCE + self._grace(process))
        elif process not in self._here:
            self._begin_absence(process)

    def _on_alive(self, key: str, alive: bool) -> None:
        process = key.removeprefix(self._prefix)
        if alive:
            self._here.add(process)
            self._absences.end(process)
        else:
            self._here.discard(process)
            self._begin_absence(process)

    def _begin_absence(self, process: str) -> None:
        self._absences.begin(process, LOSS_DEBOUNCE + self._grace(process))

    def _on_expired(self, absence: Expired) -> None:
        self._on_gone(absence.key)
