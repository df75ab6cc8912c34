"""Agenda: actions to run once or periodically, in order of time and then of creation."""

from __future__ import annotations

import heapq
from collections.abc import Callable
from math import floor


class Entry:
    """An action on an agenda. A cancelled entry stays there, empty, until its due time."""

    __slots__ = ("action", "count", "period", "start")

    def __init__(self, start: float, action: Callable[[], None], period: float) -> None:
        self.start = start
        self.action: Callable[[], None] | None = action
        self.period = period
        self.count = 0

    @property
    def due(self) -> float:
        """A multiple of the period rather than a sum of periods, so that nothing drifts."""
        return self.start + self.count * self.period

    def cancel(self) -> None:
        self.action = None


class Agenda:
    """Entries by time, in seconds of the owner's clock."""

    def __init__(self) -> None:
        self._entries: list[tuple[float, int, Entry]] = []
        self._added = 0

    def add(self, due: float, action: Callable[[], None]) -> Entry:
        """Do `action` once at `due`."""
        return self._push(Entry(due, action, 0.0))

    def add_periodic(self, start: float, period: float, action: Callable[[], None]) -> Entry:
        """Do `action` at each multiple of `period` after `start`. Raises ValueError for a period of zero or less."""
        if period <= 0.0:
            raise ValueError(f"a period has to be longer than zero; {period} s was asked for")
        entry = Entry(start, action, period)
        entry.count = 1
        return self._push(entry)

    def next_due(self) -> float | None:
        """Due time of the first entry, None if there is none."""
        while self._entries and self._entries[0][2].action is None:
            heapq.heappop(self._entries)
        return self._entries[0][0] if self._entries else None

    def take(self, now: float) -> Callable[[], None] | None:
        """Take the first action that is due by `now`, None if none is.

        A periodic action is due next at its first multiple after `now`. Missed multiples are skipped.
        """
        due = self.next_due()
        if due is None or due > now:
            return None
        entry = heapq.heappop(self._entries)[2]
        action = entry.action
        if entry.period:
            entry.count = max(entry.count + 1, floor((now - entry.start) / entry.period) + 1)
            self._push(entry)
        else:
            entry.action = None
        return action

    def shift(self, seconds: float) -> None:
        """Move all due times by `seconds`: the clock has been set."""
        for _, _, entry in self._entries:
            entry.start += seconds
        self._entries = [(entry.due, number, entry) for _, number, entry in self._entries]
        heapq.heapify(self._entries)

    def _push(self, entry: Entry) -> Entry:
        self._added += 1
        heapq.heappush(self._entries, (entry.due, self._added, entry))
        return entry
