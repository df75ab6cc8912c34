"""Actions that a skill core returns, to be carried out in order."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum, auto
from typing import TypeAlias

import msgspec

from skillwing.services.protocol import BeginGoal, EndGoal, GoalStatus, RecordOutcome, Terminal


class Hook(Enum):
    """Hooks of the developer that a core calls."""

    VALIDATE = auto()
    DISPATCH = auto()
    MODIFY = auto()
    INTERRUPT = auto()
    ENDED = auto()


class CallHook(msgspec.Struct, frozen=True):
    """Call of a hook for a goal; its outcome is an event. token: 0 before the grant. terminal: for `Hook.ENDED`."""

    hook: Hook
    goal_id: str
    inputs: Mapping[str, object]
    token: int
    started_at: float
    terminal: Terminal | None = None


class AskResources(msgspec.Struct, frozen=True):
    """Question to the resource manager; the answer, or silence, is the event `QuestionAnswered`.

    silences: number of times that it stayed unanswered so far. It is sent after a pause that grows with them.
    """

    call: BeginGoal | EndGoal | RecordOutcome
    silences: int = 0


Action: TypeAlias = GoalStatus | AskResources | CallHook
"""Statuses are to be published."""
