"""The timeline: one record for each state change, with the id of the record that caused it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any
from weakref import WeakKeyDictionary

from skillwing.services.bus import Bus
from skillwing.services.bus.identity import signed
from skillwing.services.ids import RecordIds
from skillwing.services.protocol import Keys, Record, RecordKind, encode

MARK_LENGTH = 6
"""Characters that distinguish the record ids of two processes of one name. Both can run at once: a process that was
replaced while it was stopped notices it late."""

# All writers on one bus share one sequence of ids.
_ids: WeakKeyDictionary[Bus, RecordIds] = WeakKeyDictionary()


class Timeline:
    """Writer of a process's timeline records. With keys, their key has its name, which the router guarantees."""

    def __init__(self, bus: Bus, keys: Keys) -> None:
        self._bus = bus
        key = keys.timeline if bus.identity is None else signed(keys.timeline, bus.identity.name)
        self._publisher = bus.advertise(key, events=True)
        self._ids: RecordIds | None = None

    def new_id(self) -> str:
        """An id for a record that a core writes and `publish` publishes."""
        if self._ids is None:
            # Made for the first record: a process that writes none changes the ids of no other one.
            self._ids = _ids.get(self._bus)
            if self._ids is None:
                mark = self._bus.new_id()[-MARK_LENGTH:]
                self._ids = _ids[self._bus] = RecordIds(f"{self._bus.name}~{mark}")
        return self._ids(self._bus.now())

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
        """Publish a record and return its id, `<process>~<mark>#<n>`, for use as the cause of later records."""
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
