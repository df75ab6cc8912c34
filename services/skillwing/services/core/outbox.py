"""Writing down what a step of a core wants published."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, TypeVar

from skillwing.services.protocol import Record, RecordKind

P = TypeVar("P")


class Outbox(Generic[P]):
    """Collects, in order, what one step publishes; gives timeline records their ids.

    source: name of the process. new_record_id: where ids of records come from.
    """

    def __init__(self, source: str, new_record_id: Callable[[], str]) -> None:
        self._source = source
        self._new_record_id = new_record_id
        self._pages: list[P | Record] = []

    def add(self, publication: P) -> None:
        self._pages.append(publication)

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
        self._pages.append(record)
        return record.id

    def drain(self) -> tuple[P | Record, ...]:
        """Everything since the last call."""
        if not self._pages:
            return ()
        pages, self._pages = tuple(self._pages), []
        return pages
