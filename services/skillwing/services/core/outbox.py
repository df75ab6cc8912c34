"""`Outbox`: the publications and actions of one step of a core."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, TypeVar

from skillwing.services.protocol import Record, RecordKind

P = TypeVar("P")


class Outbox(Generic[P]):
    """The publications of one step, in order. Timeline records get their ids here.

    source: name of the process. new_record_id: source of the ids.
    """

    def __init__(self, source: str, new_record_id: Callable[[], str]) -> None:
        self._source = source
        self._new_record_id = new_record_id
        self._items: list[P | Record] = []

    def add(self, publication: P) -> None:
        self._items.append(publication)

    def record(
        self,
        now: float,
        kind: RecordKind,
        subject: str,
        before: str | None,
        after: str,
        text: str,
        *,
        cause: str | None = None,
        goal_id: str | None = None,
    ) -> str:
        """Add a timeline record; returns its id."""
        record = Record(
            id=self._new_record_id(),
            t=now,
            source=self._source,
            kind=kind,
            subject=subject,
            before=before,
            after=after,
            text=text,
            cause=cause,
            goal_id=goal_id,
        )
        self._items.append(record)
        return record.id

    def drain(self) -> tuple[P | Record, ...]:
        """Take out everything since the last call."""
        if not self._items:
            return ()
        items, self._items = tuple(self._items), []
        return items
