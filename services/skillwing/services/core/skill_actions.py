"""What a skill core wants done, and the goal that it wants it done for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum, auto
from typing import Any, TypeAlias

from skillwing.services.protocol import BeginGoal, EndGoal, GoalStatus, Record, RecordOutcome, State, Terminal


class Hook(Enum):
    """The hooks of the developer that a core calls for."""

    VALIDATE = auto()
    DISPATCH = auto()
    INTERRUPT = auto()
    ENDED = auto()


@dataclass(frozen=True, slots=True)
class CallHook:
    """Call a hook for a goal; token is 0 before the grant. What comes of it goes back into the core."""

    hook: Hook
    goal_id: str
    inputs: Mapping[str, object]
    token: int
    started_at: float
    terminal: Terminal | None = None


@dataclass(frozen=True, slots=True)
class AskResources:
    """Ask the resource manager, after a pause if it has been silent `silences` times; the answer, or None for another
    silence, goes to `SkillCore.answered`."""

    call: BeginGoal | EndGoal | RecordOutcome
    silences: int = 0


Action: TypeAlias = GoalStatus | Record | AskResources | CallHook
"""Statuses and records are to be published. Actions are to be carried out in order."""


@dataclass(slots=True)
class Ending:
    """How a goal is about to end, once the resource manager has applied the effect."""

    call: EndGoal
    reason: str
    output: dict[str, Any] | None = None
    forced: bool = False


@dataclass(slots=True)
class GoalRun:
    """A goal on its way through Figure 5. owner: alive token of the client that it must not outlive, None for any."""

    goal_id: str
    inputs: Mapping[str, object]
    client: str
    started_at: float
    owner: str | None = None
    state: State | None = None
    status: GoalStatus | None = None
    record: str | None = None
    token: int = 0
    begin: BeginGoal | None = None
    dispatched: bool = False
    stop_reason: str = ""
    stop_deadline: float | None = None
    run_deadline: float | None = None
    ending: Ending | None = None
    renewals_unanswered: int = 0
    """In a row."""

    @property
    def stoppable(self) -> bool:
        """It holds a grant, and nothing has ended it yet."""
        return self.token != 0 and self.ending is None
