"""Goals that hold something, and the memory of those that do no more."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from skillwing.dsl.model import Skill
from skillwing.services.core.bounded_dict import BoundedDict
from skillwing.services.core.refusal import RefusedError
from skillwing.services.core.snapshot import FinishedGoal, GrantEntry, HistoryBucket, OnEntry
from skillwing.services.protocol import (
    EndGoal,
    Ending,
    EndKind,
    ErrorCode,
    GoalVerdict,
    Granted,
    Lost,
    ProtocolError,
    RecordOutcome,
    RenewGoal,
    Terminal,
    require_sendable,
)

GOALS_REMEMBERED = 1000
"""In each history bucket."""
NO_TOKEN = 0
"""Sent with an end by a manager that never learned whether its goal was granted, nor with which token."""
LOCAL_OUTCOMES = (Ending.BUSY, Ending.NOT_VALIDATED, Ending.INTERRUPTED, Ending.ERROR)
LONGEST_LOCAL_OUTCOME = 1 << 14
"""Bytes of a terminal answer that is stored for a manager; those of our own managers are shorter."""


@dataclass(frozen=True, slots=True)
class Grant:
    """A goal that holds what it was granted.

    inputs: defaults filled in. manager, incarnation: name of the process that runs it, and which one of that name.
    """

    skill: Skill
    inputs: Mapping[str, object]
    manager: str
    incarnation: str
    granted: Granted

    @property
    def goal_id(self) -> str:
        return self.granted.goal_id

    @property
    def token(self) -> int:
        return self.granted.token


class Ledger:
    """Every goal by its id: the grants in force, in order of their granting, and the verdicts on recent goals.

    keep: told of each grant and of each end. grants, past, last_token: what a predecessor of this process has told of.
    """

    def __init__(
        self, keep: OnEntry, grants: Iterable[Grant] = (), past: Iterable[FinishedGoal] = (), last_token: int = NO_TOKEN
    ) -> None:
        self._keep = keep
        self._grants = {grant.goal_id: grant for grant in grants}
        self._past: dict[HistoryBucket, BoundedDict[str, FinishedGoal]] = {
            shelf: BoundedDict(GOALS_REMEMBERED) for shelf in HistoryBucket
        }
        for over in past:
            self._note(over)
        self._last_token = last_token

    @property
    def grants(self) -> tuple[Grant, ...]:
        """The grants in force, the oldest first."""
        return tuple(self._grants.values())

    def next_token(self, now: float) -> int:
        """A fencing token larger than every earlier one.

        It holds the robot time in milliseconds, so that it keeps growing when a process that remembers no grants
        takes the place of this one.
        """
        self._last_token = max(self._last_token + 1, int(now * 1000))
        return self._last_token

    def open(self, grant: Grant) -> None:
        self._grants[grant.goal_id] = grant
        self._keep(GrantEntry(grant.skill.name, grant.inputs, grant.manager, grant.incarnation, grant.granted))

    def close(self, grant: Grant, verdict: GoalVerdict) -> None:
        """The goal is over, and this is what anybody is told who asks for it."""
        del self._grants[grant.goal_id]
        self.remember(FinishedGoal(grant.goal_id, grant.skill.name, grant.token, verdict))

    def remember(self, over: FinishedGoal) -> None:
        self._note(over)
        self._keep(over)

    def _note(self, over: FinishedGoal) -> None:
        self._past[over.bucket][over.goal_id] = over

    def active(self, goal_id: str) -> Grant | None:
        return self._grants.get(goal_id)

    def finished(self, goal_id: str) -> FinishedGoal | None:
        return next((over for shelf in self._past.values() if (over := shelf.get(goal_id))), None)

    def verdict(self, goal_id: str, skill: str) -> GoalVerdict | None:
        """The latest verdict on a goal; None for one never heard of.

        Refuses with STALE_TOKEN where the goal was taken from its manager, with BAD_REQUEST where the id is another
        skill's.
        """
        grant, past = self._grants.get(goal_id), self.finished(goal_id)
        owner = grant.skill.name if grant else past.skill if past else skill
        if owner != skill:
            raise RefusedError(
                ErrorCode.BAD_REQUEST,
                f"The goal {goal_id} belongs to `{owner}`, not to `{skill}`.",
                help="Give every goal an id of its own.",
            )
        if grant is not None:
            return grant.granted
        if past is not None and isinstance(past.verdict, Lost):
            text = f"The goal {goal_id} was taken away. {past.verdict.reason}"
            raise RefusedError(ErrorCode.STALE_TOKEN, text, help="Stop the skill.")
        return past.verdict if past else None


def abandons_unknown_grant(request: EndGoal) -> bool:
    """The manager gives a goal up of which it never heard whether it was granted, so that it has no token."""
    return request.how is EndKind.ERROR and request.token == NO_TOKEN


def check_fence(request: EndGoal, grant: Grant) -> None:
    """Refuse the end of another process's grant: that process has another token, or none and another incarnation."""
    if not abandons_unknown_grant(request):
        check_token(request, grant.token)
    elif request.incarnation != grant.incarnation:
        raise RefusedError(
            ErrorCode.STALE_TOKEN,
            f"The goal {request.goal_id} was granted to another process of this manager.",
            help="Leave it to that one.",
        )


def check_token(request: EndGoal | RenewGoal, token: int) -> None:
    """Refuse a request whose token is not the one that its goal was granted with."""
    if request.token != token:
        raise RefusedError(
            ErrorCode.STALE_TOKEN,
            f"Token {request.token} is not the one that goal {request.goal_id} was granted with.",
            help="Stop the skill.",
        )


def check_local_outcome(request: RecordOutcome) -> None:
    """Refuse with BAD_REQUEST a terminal answer that a goal without a grant cannot have."""
    terminal = request.terminal
    if terminal.ending not in LOCAL_OUTCOMES or _needs_a_run(terminal):
        raise RefusedError(
            ErrorCode.BAD_REQUEST,
            f"A goal that was never granted cannot end with {terminal.label}, nor with anything that needs a run.",
            help=f"Let `terminal` be {', '.join(LOCAL_OUTCOMES[:-1])} or {LOCAL_OUTCOMES[-1]}, without a result.",
            known=LOCAL_OUTCOMES,
        )
    try:
        require_sendable(terminal, LONGEST_LOCAL_OUTCOME)
    except ProtocolError as error:
        text = f"The outcome of the goal {request.goal_id} cannot be stored: {error}."
        raise RefusedError(ErrorCode.BAD_REQUEST, text, help="Give a shorter reason.") from error


def _needs_a_run(terminal: Terminal) -> bool:
    """Only a goal that has run can have these fields."""
    return terminal.result is not None or terminal.success or terminal.output is not None or terminal.forced


def unknown_goal(goal_id: str) -> RefusedError:
    return RefusedError(
        ErrorCode.UNKNOWN_GOAL, f"No goal {goal_id} was ever granted here.", help="Stop the skill and begin anew."
    )
