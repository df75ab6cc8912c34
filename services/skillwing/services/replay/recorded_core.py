"""A resource core whose every step is recorded."""

from __future__ import annotations

from collections.abc import Callable

import msgspec

from skillwing.services.core.events import Event
from skillwing.services.core.resource_core import ResourceCore, Step
from skillwing.services.core.snapshot import DatumEntry, Snapshot
from skillwing.services.journal.errors import JournalError
from skillwing.services.replay.files import StepWriter
from skillwing.services.replay.steps import Made, Taken, answer_of, encoded


class RecordedCore:
    """Wrapper round a core.

    made: arguments of the core. writer: receives its steps. journal_snapshot: sum of all steps in the journal, from
    which a new file can begin.
    """

    def __init__(
        self, core: ResourceCore, made: Made, writer: StepWriter, journal_snapshot: Callable[[], Snapshot | None]
    ) -> None:
        self._core = core
        self._writer = writer
        self._journal_snapshot = journal_snapshot
        writer.write(lambda: made)

    def step(self, event: Event, now: float) -> Step:
        """Take a step and record it, whatever its outcome."""
        if self._writer.full:
            self._begin_file(now)
        try:
            step = self._core.step(event, now)
        except Exception as error:
            self._write(event, now, error)
            raise
        self._write(event, now, step)
        return step

    def _write(self, event: Event, now: float, outcome: Step | Exception) -> None:
        self._writer.write(lambda: Taken(now, event, msgspec.Raw(encoded(answer_of(outcome)))))

    def _begin_file(self, now: float) -> None:
        """Begin a file with an equal core, if one can be made at this moment."""
        data = self._core.data
        if data.freshness_unknown(data.names, now):
            return
        try:
            snapshot = self._journal_snapshot()
        except JournalError:
            return
        if snapshot is not None:
            readings = (data.reading(name, now) for name in data.names)
            entries = tuple(DatumEntry(each.name, each.value, each.t) for each in readings if each.t is not None)
            snapshot = msgspec.structs.replace(snapshot, data=entries)
            self._writer.begin_file(Made(now, None, snapshot, same_data=False))
