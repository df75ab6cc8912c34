"""What a resource manager must not forget: an entry for each change of its memory, and the memory as a whole.

Plain values: a journal stores the entries of a step before anybody hears of the step, and another process goes on from
what they add up to.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import TypeAlias

from skillwing.services.protocol import Ended, Ending, GoalVerdict, Granted, NotReady, Record, Terminal


@dataclass(frozen=True, slots=True)
class ResourceEntry:
    """The state of a resource, the revision that brought it there, and the timeline record of that; "" for none."""

    resource: str
    state: str
    revision: int
    record: str


@dataclass(frozen=True, slots=True)
class GrantEntry:
    """A goal holds from now on what it was granted. inputs: defaults filled in."""

    skill: str
    inputs: Mapping[str, object]
    manager: str
    incarnation: str
    granted: Granted


class HistoryBucket(StrEnum):
    """Verdicts that are remembered together: none of another kind pushes them out."""

    GRANTED = "granted"
    """On goals that held something."""
    GIVEN_UP = "given up"
    """On goals that were ended before they held anything, and must not begin when a request comes late."""
    REFUSED = "refused"
    """On goals that could not begin. Whoever is refused tries again, many times a second."""


@dataclass(frozen=True, slots=True)
class FinishedGoal:
    """A goal holds nothing any more, or never did. token: of its grant, if it had one; verdict: the last word on it."""

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


@dataclass(frozen=True, slots=True)
class ManagerEntry:
    """Another process has taken the place of a manager, or is the first of its name."""

    manager: str
    incarnation: str


@dataclass(frozen=True, slots=True)
class DatumEntry:
    """The value of a datum that never turns stale; any other is measured anew sooner than it matters."""

    name: str
    value: object
    t: float


Entry: TypeAlias = ResourceEntry | GrantEntry | FinishedGoal | ManagerEntry | DatumEntry
OnEntry: TypeAlias = Callable[[Entry], None]
"""Where parts of a core put their entries."""


@dataclass(frozen=True, slots=True)
class Snapshot:
    """What the entries of all steps add up to, each kind in the order in which it was kept.

    resources: one for each; goals, managers: the latest of them; last_token: the largest that was ever granted;
    records: the latest timeline records; t: robot time of the last step.
    """

    resources: tuple[ResourceEntry, ...]
    grants: tuple[GrantEntry, ...]
    goals: tuple[FinishedGoal, ...]
    managers: tuple[ManagerEntry, ...]
    data: tuple[DatumEntry, ...]
    last_token: int
    records: tuple[Record, ...]
    t: float
