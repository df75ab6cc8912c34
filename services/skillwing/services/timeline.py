"""The timeline: one record for each state change of anything, each naming the record that caused it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any
from weakref import WeakKeyDictionary

from skillwing.services.bus import Bus
from skillwing.services.ids import RecordIds
from skillwing.services.protocol import Keys, Record, RecordKind, encode

MARK_LENGTH = 6
"""Characters by which the ids of a process's records differ from those of others of its name, of which two may be
awake at once: one that was replaced while it was stopped has not noticed yet."""

# Everything that writes on one bus shares one sequence of ids.
_ids: WeakKeyDictionary[Bus, RecordIds] = WeakKeyDictionary()


class Timeline:
    """A process's pen for the timeline."""

    def __init__(self, bus: Bus, keys: Keys) -> None:
        self._bus = bus
        self._publisher = bus.advertise(keys.timeline, events=True)
        ids = _ids.get(bus)
        if ids is None:
            ids = _ids[bus] = RecordIds(f"{bus.name}~{bus.new_id()[-MARK_LENGTH:]}")
        self._ids = ids

    def new_id(self) -> str:
        """An id for a record that somebody else writes, and `publish` publishes."""
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
        """Publish a record of now and return its id, `<process>~<mark>#<n>`: the cause of what follows from it."""
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
