"""Entries of the journal, one for each change of a resource manager's memory, and the snapshot that they add up to.

Plain values: a journal stores the entries of a step before the step is published. Another process continues from the
snapshot.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from enum import StrEnum
from typing import TypeAlias

import msgspec

from skillwing.services.protocol import NO_TOKEN, Ended, Ending, GoalVerdict, Granted, NotReady, Record, Terminal


class ResourceEntry(msgspec.Struct, frozen=True, tag="resource"):
    """State of a resource, the change set that brought it there, counted from 1, and the timeline record of that.

    A resource that never changed has 0 and "".
    """

    resource: str
    state: str
    change_set: int
    record: str


class GrantEntry(msgspec.Struct, frozen=True, tag="grant"):
    """A new grant. inputs: defaults filled in."""

    skill: str
    inputs: Mapping[str, object]
    manager: str
    incarnation: str
    granted: Granted


class HistoryBucket(StrEnum):
    """Groups of finished goals. Each group is bounded by itself, so that none pushes another one out."""

    GRANTED = "granted"
    """Goals that held a grant."""
    GIVEN_UP = "given up"
    """Goals that ended before they held a grant. They must not begin when a request comes late."""
    REFUSED = "refused"
    """Goals that could not begin. Clients repeat such requests, many times a second."""


class FinishedGoal(msgspec.Struct, frozen=True, tag="finished_goal"):
    """A goal that holds no grant any more, or never did. token: of its grant, if it had one; verdict: the last one."""

    goal_id: str
    skill: str
    token: int
    verdict: GoalVerdict

    @property
    def bucket(self) -> HistoryBucket:
        match self.verdict:
            case _ if self.token:
                return HistoryBucket.GRANTED
            case NotReady() | Ended(terminal=Terminal(ending=Ending.BUSY | Ending.NOT_VALIDATED)):
                return HistoryBucket.REFUSED
            case _:
                return HistoryBucket.GIVEN_UP


class ManagerEntry(msgspec.Struct, frozen=True, tag="manager"):
    """A process that is the latest one of a manager's name."""

    manager: str
    incarnation: str


class DatumEntry(msgspec.Struct, frozen=True, tag="datum"):
    """Value of a datum that never turns stale. Any other datum is measured again before its value matters."""

    name: str
    value: object
    t: float


Entry: TypeAlias = ResourceEntry | GrantEntry | FinishedGoal | ManagerEntry | DatumEntry
OnEntry: TypeAlias = Callable[[Entry], None]
"""Receiver of the entries of a core's parts."""


class Snapshot(msgspec.Struct, frozen=True):
    """Sum of the entries of all steps, each kind in the order in which it was written.

    resources: one entry for each; goals, managers: the latest of them; last_token: the largest token of any grant;
    step: number of the last step that told anything; epoch: name of the series of its numbers; records: the latest
    timeline records; t: robot time of the last step.
    """

    resources: tuple[ResourceEntry, ...] = ()
    grants: tuple[GrantEntry, ...] = ()
    goals: tuple[FinishedGoal, ...] = ()
    managers: tuple[ManagerEntry, ...] = ()
    data: tuple[DatumEntry, ...] = ()
    last_token: int = NO_TOKEN
    step: int = 0
    epoch: str = ""
    records: tuple[Record, ...] = ()
    t: float = 0.0


EMPTY_SNAPSHOT = Snapshot()
