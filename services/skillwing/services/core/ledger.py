"""Active grants, and the history of finished goals."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

from skillwing.dsl.model import Skill
from skillwing.services.core.bounded_dict import GOALS_REMEMBERED, BoundedDict
from skillwing.services.core.refusal import RefusedError
from skillwing.services.core.snapshot import FinishedGoal, GrantEntry, HistoryBucket, OnEntry
from skillwing.services.protocol import NO_TOKEN, EndGoal, ErrorCode, GoalVerdict, Granted, RenewGoal


@dataclass(frozen=True, slots=True)
class Grant:
    """Grant of a goal.

    inputs: defaults filled in. manager, incarnation: name of the process that runs it, and which one of that name.
    owner: client that started the goal; granted_at: robot time. Both are not in the journal: the first is empty for a
    grant from before a restart, the second infinite. exit_record: timeline record of the exit of that process.
    """

    skill: Skill
    inputs: Mapping[str, object]
    manager: str
    incarnation: str
    granted: Granted
    owner: str = field(default="", compare=False)
    granted_at: float = field(default=math.inf, compare=False)
    exit_record: str | None = field(default=None, compare=False)

    @property
    def goal_id(self) -> str:
        return self.granted.goal_id

    @property
    def token(self) -> int:
        return self.granted.token


class Ledger:
    """Every goal by its id: active grants in the order of their granting, and finished goals.

    on_entry: receives an entry for each grant and each end. grants, finished, last_token: from the snapshot.
    """

    def __init__(
        self,
        on_entry: OnEntry,
        grants: Iterable[Grant] = (),
        finished: Iterable[FinishedGoal] = (),
        last_token: int = NO_TOKEN,
    ) -> None:
        self._on_entry = on_entry
        self._active = {grant.goal_id: grant for grant in grants}
        self._finished: dict[HistoryBucket, BoundedDict[str, FinishedGoal]] = {
            bucket: BoundedDict(GOALS_REMEMBERED) for bucket in HistoryBucket
        }
        for goal in finished:
            self._finished[goal.bucket][goal.goal_id] = goal
        self._last_token = last_token

    @property
    def grants(self) -> tuple[Grant, ...]:
        """Active grants, the oldest first."""
        return tuple(self._active.values())

    def next_token(self, now: float) -> int:
        """A fencing token larger than every earlier one.

        It contains the robot time in milliseconds. So it keeps growing when a process without a journal takes over.
        """
        self._last_token = max(self._last_token + 1, int(now * 1000))
        return self._last_token

    def open(self, grant: Grant) -> None:
        """Add an active grant."""
        self._active[grant.goal_id] = grant
        self._on_entry(GrantEntry(grant.skill.name, grant.inputs, grant.manager, grant.incarnation, grant.granted))

    def note_exit(self, manager: str, record: str, t: float) -> None:
        """Note that the process which holds the grants of a manager has ended. Grants after `t` are its successor's."""
        for goal_id, grant in self._active.items():
            if grant.manager == manager and grant.granted_at <= t:
                self._active[goal_id] = replace(grant, exit_record=record)

    def close(self, grant: Grant, verdict: GoalVerdict) -> None:
        """End an active grant; `verdict` answers every later question about the goal."""
        del self._active[grant.goal_id]
        self.remember(FinishedGoal(grant.goal_id, grant.skill.name, grant.token, verdict))

    def remember(self, goal: FinishedGoal) -> None:
        """Add a finished goal."""
        self._finished[goal.bucket][goal.goal_id] = goal
        self._on_entry(goal)

    def active(self, goal_id: str) -> Grant | None:
        """The active grant of a goal."""
        return self._active.get(goal_id)

    def finished(self, goal_id: str) -> FinishedGoal | None:
        """The finished goal of that id."""
        for bucket in self._finished.values():
            goal = bucket.get(goal_id)
            if goal is not None:
                return goal
        return None

    def verdict(self, goal_id: str, skill: str) -> GoalVerdict | None:
        """The latest verdict on a goal; None for an unknown one. Refuses the id of another skill with BAD_REQUEST."""
        grant, finished = self._active.get(goal_id), self.finished(goal_id)
        owner = grant.skill.name if grant else finished.skill if finished else skill
        if owner != skill:
            raise RefusedError(
                ErrorCode.BAD_REQUEST,
                f"The goal {goal_id} belongs to `{owner}`, not to `{skill}`.",
                help="Give every goal an id of its own.",
            )
        if grant is not None:
            return grant.granted
        return finished.verdict if finished else None


def check_token(request: EndGoal | RenewGoal, token: int) -> None:
    """Refuse a request whose token is not the one of the goal's grant."""
    if request.token != token:
        raise RefusedError(
            ErrorCode.STALE_TOKEN,
            f"Token {request.token} is not the one that goal {request.goal_id} was granted with.",
            help="Stop the skill.",
        )


def unknown_goal(goal_id: str) -> RefusedError:
    """The refusal for a goal that never had a grant."""
    return RefusedError(
        ErrorCode.UNKNOWN_GOAL, f"No goal {goal_id} was ever granted here.", help="Stop the skill and begin again."
    )
