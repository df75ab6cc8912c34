"""The timeline: one record for each state change of anything, each naming the record that caused it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any
from weakref import WeakKeyDictionary

from skillwing.services.bus import Bus
from skillwing.services.ids import RecordIds
from skillwing.services.protocol import Keys, Record, RecordKind, encode

# Everything that writes in one process shares one sequence of ids.
_ids: WeakKeyDictionary[Bus, RecordIds] = WeakKeyDictionary()


class Timeline:
    """A process's pen for the timeline."""

    def __init__(self, bus: Bus, keys: Keys) -> None:
        self._bus = bus
        self._publisher = bus.advertise(keys.timeline, events=True)
        self._ids = _ids.setdefault(bus, RecordIds(bus.name))

    def new_id(self) -> str:
        """An id for a record that somebody else writes, and `publish` publishes."""
        return self._ids(self._bus.now())

    def continue_after(self, record_id: str) -> None:
        """Give no id that a process of this name has given up to this record."""
        self._ids.skip(record_id)

    def record(
        self,
        kind: RecordKind,
        subject: str,
        before: str | None,
        after: str,
        *,
        text: str = "",
        cause: str | None = None,
        goal_id: str | None = None,
        detail: Mapping[str, Any] | None = None,
    ) -> str:
        """Publish a record of now and return its id, `<process name>#<n>`, to be the cause of what follows from it."""
        record = Record(
            id=self.new_id(),
            t=self._bus.now(),
            source=self._bus.name,
            kind=kind,
            subject=subject,
            before=before,
            after=after,
            text=text,
            cause=cause,
            goal_id=goal_id,
            detail=dict(detail or {}),
        )
        self.publish(record)
        return record.id

    def publish(self, record: Record) -> None:
        """Publish a record that a core has written with an id from `new_id`."""
        self._publisher.put(encode(record))
