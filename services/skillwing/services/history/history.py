"""The history of a run, folded from the managers' messages: skill bars, resource lanes, causes and switches.

Pure: the same set of messages gives the same history, in any order and with any repetition. Times are robot time in
seconds.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum

from msgspec.structs import replace as replaced

from skillwing.dsl.model import Skillset
from skillwing.services.history.goal_ends import was_lost
from skillwing.services.names import RESOURCE_MANAGER
from skillwing.services.protocol import Ending, GoalStatus, MissionPhase, Record, RecordKind, State, Terminal

PHASES = frozenset(MissionPhase)
"""Phases of a mission. A mission record with any other state is a switch between branches of its tree."""


class GoalOutcome(StrEnum):
    """Outcome of a goal: the colour of its skill bar, as in the paper's timelines."""

    RUNNING = "running"
    SUCCESS = "success"
    FAILURE = "failure"
    INTERRUPTED = "interrupted"


@dataclass(frozen=True, slots=True)
class SkillBar:
    """One goal from its first message to its end. `t_end` and `terminal` are None while it runs.

    ran: it passed validation and preconditions. terminal: label of its ending (`S_ARRIVED`, `RI`, `IT`, ...). reason: a
    sentence. record: id of the timeline record of its last change.
    """

    skill: str
    goal_id: str
    t_start: float
    ran: bool
    t_end: float | None = None
    terminal: str | None = None
    outcome: GoalOutcome = GoalOutcome.RUNNING
    reason: str = ""
    record: str | None = None

    @property
    def refused(self) -> bool:
        """True for a goal that ended before it ran: its inputs, the preconditions or another goal prevented it."""
        return self.terminal is not None and not self.ran


@dataclass(frozen=True, slots=True)
class StateSpan:
    """Interval in which a resource had a state; `t_end` is None for the present one."""

    state: str
    t_start: float
    t_end: float | None


@dataclass(frozen=True, slots=True)
class SwitchEvent:
    """Change of a mission to another branch of its tree. chain: records from the root cause to the switch itself."""

    t: float
    before: str
    after: str
    chain: tuple[Record, ...]


def goal_outcome(terminal: Terminal) -> GoalOutcome:
    if terminal.ending is Ending.INTERRUPTED:
        return GoalOutcome.INTERRUPTED
    return GoalOutcome.SUCCESS if terminal.ending is Ending.SUCCEEDED and terminal.success else GoalOutcome.FAILURE


def is_switch(record: Record) -> bool:
    """True for a mission record that leaves one branch for another; the first choice of a branch leaves none."""
    return record.kind is RecordKind.MISSION and bool(record.before) and record.after not in PHASES


class History:
    """Folds records and goal statuses.

    skillset: gives the resources' initial states. Without it a history holds just what was recorded. longest_chain:
    number of records at which a chain of causes is cut.
    """

    def __init__(self, skillset: Skillset | None = None, *, longest_chain: int = sys.maxsize) -> None:
        self._longest_chain = longest_chain
        self._skillset = skillset or Skillset("")
        self._initial = {resource.name: resource.initial for resource in self._skillset.resources}
        self._records: dict[str, Record] = {}
        self._earlier: dict[str, Record] = {}
        self._statuses: dict[str, list[GoalStatus]] = {}
        self._ends: dict[str, Record] = {}

    @classmethod
    def of(
        cls,
        records: Iterable[Record],
        statuses: Iterable[GoalStatus] = (),
        skillset: Skillset | None = None,
    ) -> History:
        history = cls(skillset)
        for record in records:
            history.add_record(record)
        for status in statuses:
            history.add_status(status)
        return history

    def add_record(self, record: Record) -> bool:
        """Add a record; returns False for a known one."""
        if record.id in self._records:
            return False
        self._records[record.id] = record
        if record.kind is RecordKind.GOAL and record.goal_id and record.after in _ENDED_BY_OTHERS:
            known = self._ends.get(record.goal_id, record)
            self._ends[record.goal_id] = min(known, record, key=_authority)
        return True

    def add_status(self, status: GoalStatus) -> bool:
        """Add a status; returns False for a known one."""
        known = self._statuses.setdefault(status.goal_id, [])
        if status in known:
            return False
        known.append(status)
        return True

    def is_late(self, message: GoalStatus | Record) -> bool:
        """True for news about a goal from a process that did not know yet that the resource manager had ended it.

        A manager that hangs, or was stopped, publishes such news when it wakes up.
        """
        lost = self._lost(message.goal_id)
        return lost is not None and message.source != lost.source and message.t > lost.t

    def _lost(self, goal_id: str | None) -> Record | None:
        """The resource manager's record of a lost goal, after which no other end counts."""
        end = self._ends.get(goal_id or "")
        return end if end is not None and end.after == Ending.LOST and end.source == RESOURCE_MANAGER else None

    @property
    def timeline(self) -> tuple[Record, ...]:
        """The records in order of time, each goal with one ending: without late news about it."""
        return tuple(
            record for record in self.records if record.kind is not RecordKind.GOAL or not self.is_late(record)
        )

    def part(self, begin: float, end: float = math.inf) -> History:
        """The history from `begin` to `end`, in seconds since `begin`. Older causes have negative times."""
        states = {name: _state_at(spans, begin) for name, spans in self.lanes.items()}
        part = History(self._skillset, longest_chain=self._longest_chain)
        part._initial = {name: state for name, state in states.items() if state is not None}
        for record in self._records.values():
            shifted = replaced(record, t=record.t - begin)
            if begin <= record.t <= end:
                part.add_record(shifted)
            elif record.t < begin:
                part._earlier[record.id] = shifted
        for bar in self.bars:
            if bar.t_start <= end and (bar.t_end is None or bar.t_end >= begin):
                for status in self._statuses[bar.goal_id]:
                    if status.t <= end:
                        part.add_status(replaced(status, t=status.t - begin))
        return part

    @property
    def records(self) -> tuple[Record, ...]:
        """Records in order of time, none before its cause; those of an instant in the order of their process."""
        places = _places(self._records)
        return tuple(sorted(self._records.values(), key=lambda record: (places[record.id], _moment(record))))

    def __contains__(self, goal_id: str) -> bool:
        """True for a goal with a known status."""
        return goal_id in self._statuses

    @property
    def end(self) -> float:
        """The latest time of all messages; 0 for an empty history."""
        return max(self._times(), default=0.0)

    @property
    def first(self) -> float:
        """The earliest time of all messages; 0 for an empty history."""
        return min(self._times(), default=0.0)

    def _times(self) -> Iterator[float]:
        yield from (record.t for record in self._records.values())
        yield from (status.t for known in self._statuses.values() for status in known)

    def bar(self, goal_id: str) -> SkillBar:
        """The bar of a goal; KeyError for a goal without a status.

        If its manager died before it published the end, the record of another process ends the goal. A goal that the
        resource manager has lost ended then, whatever its manager publishes later.
        """
        known = self._statuses[goal_id]
        start = min(status.t for status in known)
        ran = any(status.state in _RAN or was_lost(status) for status in known)
        ends = [status for status in known if status.terminal is not None]
        last = min(ends, key=_when) if ends else max(known, key=_when)
        bar = SkillBar(last.skill, goal_id, start, ran, record=last.record)
        if last.terminal is not None and not self.is_late(last):
            terminal = last.terminal
            return replace(
                bar, t_end=last.t, terminal=terminal.label, outcome=goal_outcome(terminal), reason=terminal.reason
            )
        if (end := self._ends.get(goal_id)) is not None:
            outcome = GoalOutcome.INTERRUPTED if end.after == Ending.INTERRUPTED else GoalOutcome.FAILURE
            return replace(
                bar, t_end=max(start, end.t), terminal=end.after, outcome=outcome, reason=end.text, record=end.id
            )
        return bar

    @property
    def bars(self) -> tuple[SkillBar, ...]:
        """The bars of all goals, in order of their start."""
        bars = (self.bar(goal_id) for goal_id in self._statuses)
        return tuple(sorted(bars, key=lambda bar: (bar.t_start, bar.skill, bar.goal_id)))

    @property
    def lanes(self) -> dict[str, tuple[StateSpan, ...]]:
        """The states of every resource without gaps: each span ends at the start of the next one."""
        changes: dict[str, list[Record]] = {name: [] for name in self._initial}
        for record in self.records:
            if record.kind is RecordKind.RESOURCE:
                changes.setdefault(record.subject, []).append(record)
        return {name: _spans(self._initial.get(name), records) for name, records in changes.items()}

    def chain(self, record_id: str | None) -> tuple[Record, ...]:
        """The causes of a record, from the root to the record itself. An unknown record cuts the chain short."""
        chain: list[Record] = []
        seen: set[str] = set()
        while record_id is not None and record_id not in seen and len(chain) < self._longest_chain:
            record = self._records.get(record_id) or self._earlier.get(record_id)
            if record is None:
                break
            seen.add(record_id)
            chain.append(record)
            record_id = record.cause
        return tuple(reversed(chain))

    @property
    def switches(self) -> tuple[SwitchEvent, ...]:
        return tuple(
            SwitchEvent(record.t, record.before or "", record.after, self.chain(record.id))
            for record in self.records
            if is_switch(record)
        )


_RAN = frozenset({State.DISPATCHING, State.RUNNING, State.INTERRUPTING})
# Endings that another process than the skill's manager may publish.
_ENDED_BY_OTHERS = frozenset({Ending.LOST, Ending.INVARIANT_VIOLATED, Ending.ERROR, Ending.INTERRUPTED})


def _authority(end: Record) -> tuple[bool, tuple[float, str, int, str]]:
    """Order of the records that end a goal: the resource manager's first, else the earliest."""
    return end.source != RESOURCE_MANAGER, _moment(end)


def _when(status: GoalStatus) -> tuple[float, str, str]:
    return status.t, str(status.state), status.record or ""


def _places(records: Mapping[str, Record]) -> dict[str, tuple[float, int]]:
    """Places of records in order of time, but no record before its cause.

    Clocks of processes differ by some milliseconds, so a cause may seem later than its effect. Then the effect comes
    after everything of the cause's instant: that is one step of a process.
    """
    places: dict[str, tuple[float, int]] = {}
    for record in records.values():
        chain: list[Record] = []
        each: Record | None = record
        while each is not None and each.id not in places:
            places[each.id] = each.t, 0  # ends the search in a loop of causes
            chain.append(each)
            each = records.get(each.cause or "")
        for each in reversed(chain):
            t, rank = places.get(each.cause or "", (each.t, 0))
            places[each.id] = (t, rank + 1) if t > each.t else (each.t, rank if t == each.t else 0)
    return places


def _moment(record: Record) -> tuple[float, str, int, str]:
    process, _, number = record.id.rpartition("#")
    return record.t, process, int(number) if number.isdecimal() else 0, record.id


def _spans(initial: str | None, changes: list[Record]) -> tuple[StateSpan, ...]:
    """Spans of one resource. Its first state is the first change's `before`, or else `initial`."""
    first = changes[0].before if changes and changes[0].before else initial
    moments = [(0.0, first)] if first else []
    moments += [(change.t, change.after) for change in changes]
    ends = [t for t, _ in moments[1:]] + [None]
    spans = (StateSpan(state, t, end) for (t, state), end in zip(moments, ends, strict=True))
    return tuple(span for span in spans if span.t_end is None or span.t_end > span.t_start)


def _state_at(spans: tuple[StateSpan, ...], t: float) -> str | None:
    return next((span.state for span in spans if span.t_end is None or span.t_end > t), None)
