"""Leases in wall time: a robot clock that stands still must not keep anything alive.

Silence means something only while this process can hear. After it was cut off from the network, or did not run, every
lease begins again.
"""

from __future__ import annotations

from dataclasses import dataclass

LONGEST_PAUSE = 1.0
"""Seconds between two looks, after which this process itself did not run."""
RECOVERY = 1.0
"""Seconds by which other processes may reconnect later than this one to a restarted router."""
LOOK_PERIOD = 0.25
"""Seconds within which `look` has to be called again, so that it notices pauses."""
_SHORTEST_DELAY = 0.001


@dataclass(slots=True)
class _Lease:
    length: float
    since: float


@dataclass(frozen=True, slots=True)
class Expired:
    """A lease that has run out. key: its name; silence: seconds since it was renewed."""

    key: str
    silence: float


class Leases:
    """Leases by key. Every method takes the wall time in seconds, from any origin and never running backwards."""

    def __init__(self) -> None:
        self._leases: dict[str, _Lease] = {}
        self._looked = 0.0

    def __contains__(self, key: str) -> bool:
        return key in self._leases

    @property
    def keys(self) -> tuple[str, ...]:
        """The leases that run, the oldest first."""
        return tuple(self._leases)

    def begin(self, key: str, length: float, now: float) -> None:
        """Begin a lease of `length` seconds, or renew it with that length."""
        if not self._leases:
            self._looked = now
        self._leases[key] = _Lease(length, now)

    def renew(self, key: str, length: float, now: float) -> None:
        """Let a lease run for `length` seconds from now, if there is one of that name."""
        if key in self._leases:
            self._leases[key] = _Lease(length, now)

    def extend(self, key: str, length: float) -> None:
        """Let a lease run for `length` seconds from its beginning, if there is one of that name that is shorter."""
        if key in self._leases:
            self._leases[key].length = max(self._leases[key].length, length)

    def end(self, key: str) -> None:
        """End a lease. Idempotent."""
        self._leases.pop(key, None)

    def look(self, now: float, *, hearing: bool) -> tuple[Expired, ...]:
        """Take out and return the leases that have run out. hearing: this process is connected to the network."""
        paused = now - self._looked > LONGEST_PAUSE
        self._looked = now
        if paused or not hearing:
            for lease in self._leases.values():
                lease.since = now + RECOVERY
            return ()
        expired = [Expired(key, now - each.since) for key, each in self._leases.items() if now >= _end(each)]
        for each in expired:
            del self._leases[each.key]
        return tuple(expired)

    def next_look(self, now: float) -> float | None:
        """Seconds until `look` is due; None without leases."""
        if not self._leases:
            return None
        earliest = min(_end(lease) for lease in self._leases.values())
        return min(max(earliest - now, _SHORTEST_DELAY), LOOK_PERIOD)


def _end(lease: _Lease) -> float:
    return lease.since + lease.length
