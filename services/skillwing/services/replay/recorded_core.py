"""A resource core that has each of its steps written down."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import msgspec

from skillwing.dsl.model import Skillset
from skillwing.services.core.latest_data import LatestData
from skillwing.services.core.resource_core import ResourceCore, Step
from skillwing.services.core.snapshot import DatumEntry, Snapshot
from skillwing.services.journal.errors import JournalError
from skillwing.services.protocol import (
    AttachManager,
    BeginGoal,
    DataSample,
    EndGoal,
    FireEvent,
    FireExtern,
    RecordOutcome,
    RenewGoal,
)
from skillwing.services.replay.files import StepWriter
from skillwing.services.replay.steps import (
    Answer,
    Asked,
    Attach,
    Begin,
    Datum,
    End,
    Event,
    Extern,
    GoalSilent,
    Made,
    ManagerGone,
    Outcome,
    Question,
    Renew,
    Resume,
    Tick,
    answer_of,
    encoded,
)


class RecordedCore(ResourceCore):
    """Arguments are those of `ResourceCore`, and two more.

    writer: gets the steps. remembered: what the journal holds of all steps so far, from which a new file can begin.
    now: robot time of its making.
    """

    def __init__(
        self,
        skillset: Skillset,
        *,
        source: str,
        new_record_id: Callable[[], str],
        writer: StepWriter,
        remembered: Callable[[], Snapshot | None],
        now: float,
        found: Mapping[str, str] | None = None,
        kept: Snapshot | None = None,
        data: LatestData | None = None,
    ) -> None:
        self._writer = writer
        self._remembered = remembered
        self._t = now
        self._record_ids: list[str] = []
        self._give_record_id = new_record_id
        super().__init__(skillset, source=source, new_record_id=self._record_id, found=found, kept=kept, data=data)
        made = Made(now, None if found is None else dict(found), kept, same_data=data is not None)
        writer.write(lambda: made)

    # --- the steps ---------------------------------------------------------------------------------------------------

    def resume(self, kept: Snapshot, now: float) -> Step[Any]:
        return self._noted(Resume(kept), now, super())

    def fire_extern(self, request: FireExtern, now: float) -> Step[Any]:
        return self._noted(Extern(request), now, super())

    def fire_event(self, request: FireEvent, now: float) -> Step[Any]:
        return self._noted(Event(request), now, super())

    def update_datum(self, sample: DataSample, now: float) -> Step[Any]:
        return self._noted(Datum(sample), now, super())

    def tick(self, now: float) -> Step[Any]:
        return self._noted(Tick(), now, super())

    def attach_manager(self, request: AttachManager, now: float) -> Step[Any]:
        return self._noted(Attach(request), now, super())

    def begin(self, request: BeginGoal, now: float) -> Step[Any]:
        return self._noted(Begin(request), now, super())

    def end(self, request: EndGoal, now: float) -> Step[Any]:
        return self._noted(End(request), now, super())

    def record_outcome(self, request: RecordOutcome, now: float) -> Step[Any]:
        return self._noted(Outcome(request), now, super())

    def renew(self, request: RenewGoal) -> Step[Any]:
        return self._noted(Renew(request), self._t, super())

    def manager_lost(self, manager: str, now: float, reason: str = "its alive token is gone") -> Step[Any]:
        return self._noted(ManagerGone(manager, reason), now, super())

    def goal_lost(self, goal_id: str, now: float, reason: str) -> Step[Any]:
        return self._noted(GoalSilent(goal_id, reason), now, super())

    # --- writing them down -------------------------------------------------------------------------------------------

    def _record_id(self) -> str:
        self._record_ids.append(self._give_record_id())
        return self._record_ids[-1]

    def _noted(self, question: Question, now: float, plain: ResourceCore) -> Step[Any]:
        """Take a step as a plain core does, and write it down, whatever comes of it."""
        if self._writer.full:
            self._begin_file()
        self._t = now
        self._record_ids.clear()
        try:
            step = question.put_to(plain, now)
        except Exception as error:
            self._write(question, answer_of(error))
            raise
        self._write(question, answer_of(step))
        return step

    def _write(self, question: Question, answer: Answer) -> None:
        self._writer.write(lambda: Asked(self._t, question, tuple(self._record_ids), msgspec.Raw(encoded(answer))))

    def _begin_file(self) -> None:
        """Begin a file with a core that behaves as this one, unless none such can be made just now."""
        names, now = self.data_names, self._t
        if self.data.freshness_unknown(names, now):
            return
        try:
            kept = self._remembered()
        except JournalError:
            return
        if kept is not None:
            readings = (self.data.reading(name, now) for name in names)
            data = tuple(DatumEntry(each.name, each.value, each.t) for each in readings if each.t is not None)
            self._writer.begin_file(Made(now, None, replace(kept, data=data), same_data=False))
