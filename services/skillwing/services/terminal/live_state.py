"""Live state of a system, folded from its managers' messages, in bounded memory.

Pure: messages may come in any order, and repeatedly. Times are robot time in seconds.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

from skillwing.services.core.bounded_dict import GOALS_REMEMBERED, BoundedDict
from skillwing.services.history.goal_ends import status_of_loss
from skillwing.services.history.wording import headline
from skillwing.services.names import BLOCKED, RESOURCE_MANAGER, skill_process
from skillwing.services.protocol import (
    Ending,
    GoalProgress,
    GoalStatus,
    Record,
    RecordKind,
    State,
    Terminal,
)

GRANTED = "GRANTED"
GRANT_ENDS = ("ENDED", "VIOLATED", "LOST")
"""Last words of the resource manager's records on a goal (core/grants.py, ends.py, invariants.py, losses.py)."""

RECORDS_REMEMBERED = 2000
"""Number of records that can be named as the cause of a later one."""


@dataclass(frozen=True, slots=True)
class SkillNow:
    """One skill. goal_id, state, since: of the running goal, None and IDLE without one. feedback: its latest.

    last: terminal answer of the latest ended goal. ended: its robot time. blocked: report of a hook that did not return
    in time, in the running or the latest goal, or later.
    """

    skill: str
    goal_id: str | None = None
    state: str = "IDLE"
    since: float | None = None
    feedback: Mapping[str, Any] | None = None
    last: Terminal | None = None
    ended: float | None = None
    blocked: str = ""


@dataclass(frozen=True, slots=True)
class ResourceNow:
    """One resource. since: time of its last change, None if unknown. by: the cause of that change."""

    resource: str
    state: str
    since: float | None = None
    by: str = ""


class LiveState:
    """Follows goals, their progress, and records. States of resources come from the resource manager's answers."""

    def __init__(self) -> None:
        self._running: dict[str, GoalStatus] = {}
        self._began: dict[str, float] = {}
        self._ended: dict[str, GoalStatus] = {}
        self._ended_own: dict[str, GoalStatus] = {}
        self._progress: dict[str, GoalProgress] = {}
        self._granted: dict[str, GoalStatus] = {}
        self._over: BoundedDict[str, None] = BoundedDict(GOALS_REMEMBERED)
        self._changes: BoundedDict[str, Record] = BoundedDict(GOALS_REMEMBERED)
        self._blocked: BoundedDict[str, Record] = BoundedDict(GOALS_REMEMBERED)
        self._records: BoundedDict[str, Record] = BoundedDict(RECORDS_REMEMBERED)

    def add_status(self, status: GoalStatus) -> None:
        skill = status.skill
        if status.state is State.TERMINATED:
            _keep_last(self._ended, status)
            if not _left_another_running(status):
                _keep_last(self._ended_own, status)
            running = self._running.get(skill)
            if running is not None and running.goal_id == status.goal_id:
                del self._running[skill]
            return
        ended, running = self._ended_own.get(skill), self._running.get(skill)
        if ended is not None and (ended.goal_id == status.goal_id or ended.t > status.t):
            return
        if running is None or running.goal_id != status.goal_id:
            if running is not None and running.t > status.t:
                return
            self._began[skill] = status.t
            self._running[skill] = status
            return
        self._began[skill] = min(self._began[skill], status.t)
        if status.t >= running.t:
            self._running[skill] = status

    def add_progress(self, progress: GoalProgress) -> None:
        self._progress[progress.skill] = progress

    def add_record(self, record: Record) -> None:
        """Add a record. Grants, losses and changes count only from the resource manager: a client may be wrong."""
        self._records[record.id] = record
        if record.source == RESOURCE_MANAGER:
            if record.kind is RecordKind.GOAL and record.goal_id is not None:
                self._note_grant(record, record.goal_id)
            if (lost := status_of_loss(record)) is not None:
                self.add_status(lost)
            if record.kind is RecordKind.RESOURCE:
                _keep_latest(self._changes, record)
        if record.kind is RecordKind.PROCESS and record.after == BLOCKED:
            _keep_latest(self._blocked, record)

    def add_recorded(self, recorded: Mapping[str, GoalStatus], alive: Collection[str]) -> None:
        """Add the recorded goals of skills of which no goal is known. alive: holders of alive tokens.

        If the resource manager and the manager live, one of them would know of an unfinished goal. Then the recorded
        one is from before a restart of the system.
        """
        attended = alive if RESOURCE_MANAGER in alive else ()
        for skill, status in recorded.items():
            if self.goal(skill) is None and (status.terminal is not None or skill_process(skill) not in attended):
                self.add_status(status)

    def _note_grant(self, record: Record, goal_id: str) -> None:
        """Note the resource manager's word on a grant. The statuses of its goal may be gone with their manager."""
        if record.after == GRANTED:
            skill, t = record.subject, record.t
            known = self._granted.get(skill)
            if known is None or known.t <= t:
                self._granted[skill] = GoalStatus(goal_id=goal_id, skill=skill, state=State.RUNNING, t=t)
        elif record.after in GRANT_ENDS:
            self._over[goal_id] = None

    def _granted_goal(self, skill: str) -> GoalStatus | None:
        """The goal with a grant, of which nothing later is known."""
        granted, ended = self._granted.get(skill), self._ended_own.get(skill)
        if granted is None or granted.goal_id in self._over:
            return None
        if ended is not None and (ended.goal_id == granted.goal_id or ended.t > granted.t):
            return None
        return granted

    def _running_goal(self, skill: str) -> GoalStatus | None:
        return self._running.get(skill) or self._granted_goal(skill)

    def goal(self, skill: str) -> GoalStatus | None:
        """The running goal of a skill, else the one that ended last; None without any."""
        return self._running_goal(skill) or self._ended.get(skill)

    def skill(self, name: str) -> SkillNow:
        """The present state of a skill."""
        running, ended = self._running_goal(name), self._ended.get(name)
        last = None if ended is None else ended.terminal
        ended_at = None if ended is None else ended.t
        blocked = self._report_on_hooks(name, running or ended)
        if running is None:
            return SkillNow(name, last=last, ended=ended_at, blocked=blocked)
        progress = self._progress.get(name)
        feedback = progress.feedback if progress is not None and progress.goal_id == running.goal_id else None
        began = self._began[name] if name in self._running else running.t
        return SkillNow(name, running.goal_id, running.state, began, feedback, last, ended_at, blocked)

    def _report_on_hooks(self, name: str, latest: GoalStatus | None) -> str:
        report = self._blocked.get(skill_process(name))
        if report is None:
            return ""
        is_news = latest is None or report.goal_id == latest.goal_id or report.t >= latest.t
        return report.text if is_news else ""

    def changed_to(self, resource: str) -> str | None:
        """State to which a resource was last seen to change; None if no change was seen."""
        change = self._changes.get(resource)
        return None if change is None else change.after

    def resources(self, states: Mapping[str, str]) -> list[ResourceNow]:
        """All resources, in the order of their states."""
        return [self._resource(name, state) for name, state in states.items()]

    def _resource(self, name: str, state: str) -> ResourceNow:
        change = self._changes.get(name)
        if change is None or change.after != state:
            return ResourceNow(name, state)
        cause = None if change.cause is None else self._records.get(change.cause)
        return ResourceNow(
            name, state, change.t, headline(cause) if cause is not None else change.text or change.source
        )


def _left_another_running(status: GoalStatus) -> bool:
    """True for the end of a goal that was refused as BUSY: the earlier goal goes on."""
    return status.terminal is not None and status.terminal.ending is Ending.BUSY


def _keep_last(ends: dict[str, GoalStatus], status: GoalStatus) -> None:
    known = ends.get(status.skill)
    if known is None or status.t >= known.t:
        ends[status.skill] = status


def _keep_latest(records: BoundedDict[str, Record], record: Record) -> None:
    known = records.get(record.subject)
    if known is None or record.t >= known.t:
        records[record.subject] = record
