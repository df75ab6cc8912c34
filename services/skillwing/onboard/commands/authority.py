"""Who commands an axis, and whose commands no longer count: holders, fencing tokens, revocations."""

from __future__ import annotations

from skillwing.onboard.topics.guidance import AxisStatus, MotionState
from skillwing.services.protocol import ErrorCode, ErrorReply

REMEMBERED = 100
"""Revocations that an axis keeps while nobody takes it."""


class RefusedError(Exception):
    """A command was not taken; `reply` says why and what to do."""

    def __init__(self, code: ErrorCode, message: str, advice: str, known: tuple[str, ...] = ()) -> None:
        super().__init__(message)
        self.reply = ErrorReply(code=code, message=message, help=advice, known=known)


class Axis:
    """The body axes or the heading: its holder, and how far the holder's motion has come."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.goal: str | None = None
        self.state = MotionState.IDLE
        self.text = ""
        self.remaining = 0.0
        self._newest = -1
        self._revoked: dict[str, int] = {}

    def require_fresh(self, goal: str, token: int) -> None:
        """Raise RefusedError if a command of this goal with this token no longer counts."""
        if token < self._newest:
            raise RefusedError(
                ErrorCode.STALE_TOKEN,
                f"token {token} is older than {self._newest}, the newest one seen for the {self.name}",
                "ask the resource manager for a new grant",
            )
        if token <= self._revoked.get(goal, -1):
            raise RefusedError(
                ErrorCode.STALE_TOKEN,
                f"the authority of goal {goal} over the {self.name} was revoked",
                "start a new goal",
            )

    def take(self, goal: str, token: int) -> None:
        """Make `goal` the holder."""
        self.goal, self._newest = goal, max(token, self._newest)
        # What is older than the newest token is stale by that alone.
        self._revoked = {other: last for other, last in self._revoked.items() if last >= self._newest}

    def revoke(self, goal: str, token: int) -> bool:
        """Commands of this goal up to this token no longer count. True if the goal holds the axis."""
        if token >= self._newest:
            self._revoked[goal] = max(token, self._revoked.pop(goal, -1))
        if len(self._revoked) > REMEMBERED:
            del self._revoked[next(iter(self._revoked))]
        return goal == self.goal and token >= self._newest

    def become(self, state: MotionState, text: str = "") -> None:
        self.state, self.text = state, text

    @property
    def status(self) -> AxisStatus:
        return AxisStatus(goal_id=self.goal, state=self.state, remaining=self.remaining, text=self.text)
