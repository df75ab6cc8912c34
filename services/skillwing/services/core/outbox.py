"""`Outbox`: the publications and actions of one step of a core; `RecordOutbox` also writes timeline records."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, TypeVar

from skillwing.services.protocol import Record, RecordKind

P = TypeVar("P")


class Outbox(Generic[P]):
    """The publications of one step, in order."""

    def __init__(self) -> None:
        self._items: list[P] = []

    @property
    def empty(self) -> bool:
        """True if this step has told nothing so far."""
        return not self._items

    def add(self, publication: P) -> None:
        self._items.append(publication)

    def drain(self) -> tuple[P, ...]:
        """Take out everything since the last call."""
        if not self._items:
            return ()
        items, self._items = tuple(self._items), []
        return items


class RecordOutbox(Outbox[P | Record]):
    """An outbox that gives timeline records their ids.

    source: name of the process. new_record_id: source of the ids.
    """

    def __init__(self, source: str, new_record_id: Callable[[], str]) -> None:
        super().__init__()
        self._source = source
        self._new_record_id = new_record_id

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
