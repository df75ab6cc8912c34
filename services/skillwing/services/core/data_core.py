"""The data manager's semantics: the latest value of each datum, and its freshness."""

from __future__ import annotations

from collections.abc import Callable

from skillwing.dsl.model import Skillset, UnknownNameError
from skillwing.services.core.checks import unknown_name
from skillwing.services.core.latest_data import LatestData
from skillwing.services.core.outbox import RecordOutbox
from skillwing.services.core.refusal import RefusedError
from skillwing.services.protocol import DataReading, DataSample, ErrorCode, Record, RecordKind


class DataCore:
    """Every datum of a skillset.

    source: name of the process, for the timeline. new_record_id: gives each timeline record its id. Records
    that a method returns are about data that turned fresh or stale.
    """

    def __init__(self, skillset: Skillset, *, source: str, new_record_id: Callable[[], str]) -> None:
        self._skillset = skillset
        self._latest = LatestData(skillset)
        self._fresh: set[str] = set()
        self._outbox: RecordOutbox[Record] = RecordOutbox(source, new_record_id)

    def update(self, sample: DataSample, now: float) -> tuple[Record, ...]:
        """Take a sample. Refuses one that does not fit the model; the value known before stays."""
        self._require(sample.name)
        problem = self._latest.accept(sample, now)
        if problem is not None:
            raise RefusedError(ErrorCode.BAD_REQUEST, problem, help="Publish values of the type in the skillset.")
        return self.tick(now)

    def reading(self, name: str, now: float) -> DataReading:
        self._require(name)
        return self._latest.reading(name, now)

    def next_tick(self, now: float) -> float | None:
        """Time at which the next datum turns stale unless a sample comes in; None for never."""
        return self._latest.next_stale_at(now)

    def tick(self, now: float) -> tuple[Record, ...]:
        """Let time pass."""
        for name in self._latest.names:
            fresh = self._latest.is_fresh(name, now)
            if fresh and name not in self._fresh:
                self._fresh.add(name)
                self._outbox.record(now, RecordKind.DATA, name, "STALE", "FRESH", "")
            elif not fresh and name in self._fresh:
                self._fresh.discard(name)
                age = self._latest.reading(name, now).age or 0.0
                text = f"nothing new for {age:.2f} s"
                self._outbox.record(now, RecordKind.DATA, name, "FRESH", "STALE", text)
        return self._outbox.drain()

    def _require(self, name: str) -> None:
        try:
            self._skillset.datum(name)
        except UnknownNameError as error:
            raise unknown_name(error) from error
