"""`GoalHandle`: a goal on the client's side."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from skillwing.services.protocol import GoalStatus, State, Terminal

# A goal only ever moves forward through Figure 5: a status of a lower rank is an old one that was overtaken.
_RANK = {state: rank for rank, state in enumerate(State)}


class GoalHandle:
    """A goal on the client's side. It is kept up to date, and stays valid after the end.

    goal_id, skill: which goal. state: None until the manager's first answer. terminal: how it ended, None before.
    progress: the latest feedback. record: id of the timeline record of the last change.
    """

    def __init__(self, goal_id: str, skill: str) -> None:
        self.goal_id = goal_id
        self.skill = skill
        self.state: State | None = None
        self.terminal: Terminal | None = None
        self.progress: dict[str, Any] | None = None
        self.record: str | None = None
        self._revision = 0
        self._callbacks: list[Callable[[GoalHandle], None]] = []

    def __repr__(self) -> str:
        phase = self.terminal.label if self.terminal else self.state or "SENT"
        return f"<goal {self.goal_id} of {self.skill}: {phase}>"

    @property
    def done(self) -> bool:
        """The goal has got its one terminal answer; nothing here changes any more."""
        return self.terminal is not None

    def on_change(self, callback: Callable[[GoalHandle], None]) -> None:
        """Call `callback(self)` at each change of state or progress, until the goal is done."""
        self._callbacks.append(callback)

    def advance(self, status: GoalStatus) -> bool:
        """Take a status from the manager. False if it is not new; a goal never moves back.

        A modification is a further RUNNING.
        """
        place = _RANK[status.state], status.revision
        if self.done or (self.state is not None and place <= (_RANK[self.state], self._revision)):
            return False
        self._revision = status.revision
        self.state, self.terminal, self.record = status.state, status.terminal, status.record
        self._notify()
        return True

    def end(self, terminal: Terminal, record: str | None) -> None:
        """End the goal without an answer of its manager."""
        if not self.done:
            self.state, self.terminal, self.record = State.TERMINATED, terminal, record
            self._notify()

    def feed_back(self, progress: dict[str, Any]) -> None:
        if not self.done:
            self.progress = progress
            self._notify()

    def _notify(self) -> None:
        callbacks = list(self._callbacks)
        if self.done:
            self._callbacks.clear()
        for callback in callbacks:
            callback(self)
