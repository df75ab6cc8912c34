"""The resource manager's semantics: which goals may begin, and which may go on.

`ResourceCore.step` takes an event and the robot time. One step is atomic: it changes the state, and returns the reply
with everything to be published and stored, in order. A refused request raises `RefusedError` and changes nothing.
The rules stand in modules of their own, `RULES` says which. `docs/semantics.md` gives the reasons.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, TypeAlias

import msgspec

from skillwing.dsl.model import Skillset
from skillwing.dsl.queries import data_in_guards
from skillwing.services.core.ends import end, record_outcome
from skillwing.services.core.events import Event, GoalSilent, ManagerExited, ManagerGone, Resumed, TimePassed
from skillwing.services.core.externs_and_events import fire_event, fire_extern, take_sample
from skillwing.services.core.grants import begin, renew
from skillwing.services.core.incarnations import Incarnations
from skillwing.services.core.invariants import pass_time
from skillwing.services.core.latest_data import LatestData
from skillwing.services.core.ledger import Grant, Ledger
from skillwing.services.core.losses import attach_manager, lose_goal, lose_manager, note_exit
from skillwing.services.core.manager_state import ManagerState, Publication
from skillwing.services.core.outbox import RecordOutbox
from skillwing.services.core.ready_report import ready_report
from skillwing.services.core.resource_table import ResourceTable
from skillwing.services.core.snapshot import EMPTY_SNAPSHOT, DatumEntry, Entry, Snapshot
from skillwing.services.protocol import (
    AttachManager,
    BeginGoal,
    DataSample,
    EndGoal,
    FireEvent,
    FireExtern,
    GoalVerdict,
    Lost,
    QueryReady,
    ReadyReport,
    RecordKind,
    RecordOutcome,
    RenewGoal,
    ResourceStates,
    Violated,
)

StepReply: TypeAlias = GoalVerdict | ResourceStates | None
REPEATED_SPAN = 10.0
"""Seconds before a process's last step in which its publications may have got lost."""


class Step(msgspec.Struct, frozen=True, tag="step"):
    """Outcome of one event: reply to its sender, publications in order, and entries for the journal.

    number: of the last step that told anything, which is this one if it has publications.
    """

    reply: StepReply
    number: int
    publications: tuple[Publication, ...] = ()
    entries: tuple[Entry, ...] = ()


class ResourceCore:
    """States of all resources, the grants, and the latest values of the data that guards name.

    source: name of the process, for the timeline. new_record_id: gives each timeline record its id. found: initial
    states that differ from the skillset's. snapshot: where a predecessor stopped; the first event is then `Resumed`.
    data: instead of none yet.
    """

    def __init__(
        self,
        skillset: Skillset,
        *,
        source: str,
        new_record_id: Callable[[], str],
        found: Mapping[str, str] | None = None,
        snapshot: Snapshot = EMPTY_SNAPSHOT,
        data: LatestData | None = None,
    ) -> None:
        entries: list[Entry] = []
        on_entry = entries.append
        outbox: RecordOutbox[Publication] = RecordOutbox(source, new_record_id)
        grants = (
            Grant(skillset.skill(each.skill), each.inputs, each.manager, each.incarnation, each.granted)
            for each in snapshot.grants
        )
        self._state = ManagerState(
            source=source,
            skillset=skillset,
            table=ResourceTable(skillset, outbox, on_entry, found=found, entries=snapshot.resources),
            ledger=Ledger(on_entry, grants, snapshot.goals, snapshot.last_token),
            incarnations=Incarnations(on_entry, snapshot.managers),
            data=data or LatestData(skillset, data_in_guards(skillset)),
            outbox=outbox,
            entries=entries,
            last_step=snapshot.step,
            epoch=snapshot.epoch,
        )
        if data is None:
            for datum in snapshot.data:
                self.data.accept(DataSample(name=datum.name, value=datum.value, t=datum.t), datum.t)
        else:
            entries += _unwritten_data(data, {datum.name: datum.value for datum in snapshot.data})

    def step(self, event: Event, now: float) -> Step:
        """Apply the rule of an event."""
        state = self._state
        reply = RULES[type(event)](state, event, now)
        state.last_step = state.step
        entries = tuple(state.entries)
        state.entries.clear()
        return Step(reply, state.last_step, state.outbox.drain(), entries)

    @property
    def states(self) -> Mapping[str, str]:
        """State of each resource; a live view."""
        return self._state.table.states

    @property
    def last_step(self) -> int:
        """Number of the last step that told anything."""
        return self._state.last_step

    @property
    def epoch(self) -> str:
        """Name of the series of these numbers."""
        return self._state.epoch

    @property
    def grants(self) -> tuple[Grant, ...]:
        """The active grants, the oldest first."""
        return self._state.ledger.grants

    @property
    def data(self) -> LatestData:
        """The latest values of the data that guards name."""
        return self._state.data

    def resource_states(self, now: float) -> ResourceStates:
        """All states as a message."""
        return self._state.resource_states(now)

    def ready_report(self, query: QueryReady, now: float) -> ReadyReport:
        """The reply to a query whether skills may start; nothing changes."""
        return ready_report(self._state, query, now)

    def initial_entries(self) -> tuple[Entry, ...]:
        """The entries that a new journal begins with."""
        return self._state.table.initial_entries()

    def next_tick(self, now: float) -> float | None:
        """Time at which `TimePassed` is due if nothing happens before: the next datum turns stale. None for never."""
        return self.data.next_stale_at(now) if self.grants else None


def publications_to_repeat(snapshot: Snapshot) -> tuple[Publication, ...]:
    """Publications of a predecessor that may have got lost; none of them does harm twice."""
    since = snapshot.t - REPEATED_SPAN
    records = [record for record in snapshot.records if record.t >= since]
    verdicts = (goal.verdict for goal in snapshot.goals)
    return (*records, *(each for each in verdicts if isinstance(each, Violated | Lost) and each.t >= since))


def resume(state: ManagerState, event: Resumed, now: float) -> None:
    """Continue from a snapshot. Each datum counts as fresh for as long as its unknown latest value may be."""
    del event
    state.data.clamp_timestamps(now)
    state.data.mark_unknown(now)
    count = len(state.ledger.grants)
    goals = f"{count} goal{'' if count == 1 else 's'}"
    text = f"went on from its journal after step {state.last_step} with {goals}"
    state.outbox.record(now, RecordKind.PROCESS, state.source, None, "RESUMED", text)


RULES: Mapping[type[Event], Callable[[ManagerState, Any, float], StepReply]] = MappingProxyType(
    {
        BeginGoal: begin,
        EndGoal: end,
        RecordOutcome: record_outcome,
        RenewGoal: renew,
        AttachManager: attach_manager,
        FireExtern: fire_extern,
        FireEvent: fire_event,
        DataSample: take_sample,
        ManagerGone: lose_manager,
        ManagerExited: note_exit,
        GoalSilent: lose_goal,
        TimePassed: pass_time,
        Resumed: resume,
    }
)


def _unwritten_data(data: LatestData, written: Mapping[str, object]) -> list[Entry]:
    """Entries for values that never expire and are not in the journal, because their step could not be written."""
    entries: list[Entry] = []
    for name in data.names:
        value, t = data.value(name), data.reading(name, 0.0).t
        if t is not None and data.never_expires(name) and written.get(name) != value:
            entries.append(DatumEntry(name, value, t))
    return entries
