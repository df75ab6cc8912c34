"""Command authority over a part of the drone: its holder, fencing tokens and revocations."""

from __future__ import annotations

from skillwing.onboard.commands.service import CommandRefusedError
from skillwing.onboard.topics.guidance import AxisStatus, MotionState
from skillwing.services.protocol import ErrorCode

TAKEN_OVER = "the safety pilot has taken over"
REVOKED = "its authority was revoked"
"""Reasons of a motion that ends because its goal may no longer command it."""
NO_VIEW = "no view of the way ahead"
"""Begin of the reason of a motion that ends because nothing looks along its way."""
REMEMBERED = 100
"""Most revocations kept while no goal takes the authority."""


class CommandAuthority:
    """Authority over one part, such as the body axes, the heading, the map or the video.

    It has the goal that holds the part, and for the two axes the state of that goal's motion.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self.goal: str | None = None
        self.state = MotionState.IDLE
        self.text = ""
        self.remaining = 0.0
        self._newest = -1
        self._revoked: dict[str, int] = {}

    def require_fresh(self, goal: str, token: int) -> None:
        """Raise CommandRefusedError for a token that is older than the newest one, or revoked."""
        if token < self._newest:
            raise CommandRefusedError(
                ErrorCode.STALE_TOKEN,
                f"token {token} is older than {self._newest}, the newest one seen for the {self.name}",
                "ask the resource manager for a new grant",
            )
        if token <= self._revoked.get(goal, -1):
            raise CommandRefusedError(
                ErrorCode.STALE_TOKEN,
                f"the authority of goal {goal} over the {self.name} was revoked",
                "start a new goal",
            )

    def take(self, goal: str, token: int) -> None:
        """Make `goal` the holder."""
        self.goal, self._newest = goal, max(token, self._newest)
        # Revocations of older tokens are no longer needed: such tokens are stale anyway.
        self._revoked = {other: last for other, last in self._revoked.items() if last >= self._newest}

    def revoke(self, goal: str, token: int) -> bool:
        """Refuse commands of this goal up to this token from now on. Return True if the goal is the holder."""
        if token >= self._newest:
            self._revoked[goal] = max(token, self._revoked.pop(goal, -1))
        if len(self._revoked) > REMEMBERED:
            del self._revoked[next(iter(self._revoked))]
        return goal == self.goal and token >= self._newest

    def become(self, state: MotionState, text: str = "") -> None:
        self.state, self.text = state, text

    @property
    def status(self) -> AxisStatus:
        lost = self.state is MotionState.ABORTED and self.text in (TAKEN_OVER, REVOKED)
        return AxisStatus(
            goal_id=self.goal,
            state=self.state,
            remaining=self.remaining,
            text=self.text,
            authority_lost=lost,
            no_view=self.state is MotionState.BLOCKED and self.text.startswith(NO_VIEW),
        )
