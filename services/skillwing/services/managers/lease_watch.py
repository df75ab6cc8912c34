"""Leases on the bus, watched as long as there are any."""

from __future__ import annotations

from collections.abc import Callable

from skillwing.services.bus import Bus, Handle
from skillwing.services.core.leases import Expired, Leases


class LeaseWatch:
    """Shell of `Leases`. on_expired is called once for each lease that has run out; it may begin others.

    from_outside: the leases belong to clients that only the router connects to this process.
    """

    def __init__(self, bus: Bus, on_expired: Callable[[Expired], None], *, from_outside: bool = False) -> None:
        self._bus = bus
        self._from_outside = from_outside
        self._on_expired = on_expired
        self._leases = Leases()
        self._timer: Handle | None = None

    def __contains__(self, key: str) -> bool:
        return key in self._leases

    @property
    def keys(self) -> tuple[str, ...]:
        """Names of the leases."""
        return self._leases.keys

    def begin(self, key: str, length: float) -> None:
        """Begin a lease, or renew it."""
        self._leases.begin(key, length, self._bus.wall())
        if self._timer is None:
            self._wait()

    def renew(self, key: str, length: float) -> None:
        """Renew a lease, if there is one of that name."""
        self._leases.renew(key, length, self._bus.wall())

    def extend(self, key: str, length: float) -> None:
        """Let a lease run for at least `length` seconds from its beginning, if there is one of that name."""
        self._leases.extend(key, length)

    def end(self, key: str) -> None:
        """End a lease. Idempotent."""
        self._leases.end(key)

    def _wait(self) -> None:
        delay = self._leases.next_look(self._bus.wall())
        self._timer = None if delay is None else self._bus.after(delay, self._look, wall=True)

    def _look(self) -> None:
        hearing = self._bus.routed if self._from_outside else self._bus.connected
        expired = self._leases.look(self._bus.wall(), hearing=hearing)
        for each in expired:
            self._on_expired(each)
        self._wait()
