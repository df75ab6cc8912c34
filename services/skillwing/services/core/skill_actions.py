"""Actions that a skill core returns, to be carried out in order."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum, auto
from typing import TypeAlias

import msgspec

from skillwing.services.protocol import (
    NO_TOKEN,
    BeginGoal,
    EndGoal,
    EndKind,
    GoalStatus,
    Record,
    RecordOutcome,
    Terminal,
)


class Hook(Enum):
    """Hooks of the developer that a core calls."""

    VALIDATE = auto()
    DISPATCH = auto()
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
    """Question to the resource manager; the answer, or silence, is the event `Answered`.

    silences: number of times that it stayed unanswered so far. It is sent after a pause that grows with them.
    """

    call: BeginGoal | EndGoal | RecordOutcome
    silences: int = 0


Action: TypeAlias = GoalStatus | Record | AskResources | CallHook
"""Statuses and records are to be published."""


# --- actions of a goal, which the core turns into those above ---------------------------------------------------------


class HookCall(msgspec.Struct, frozen=True):
    """Call of a hook. token: of the grant."""

    hook: Hook
    token: int = NO_TOKEN


class AskBegin(msgspec.Struct, frozen=True):
    """Question: may the goal begin?"""


class AskEnd(msgspec.Struct, frozen=True):
    """Question: has the effect of this end been applied?"""

    token: int
    how: EndKind
    result: str | None = None


class AskCommit(msgspec.Struct, frozen=True):
    """Question: is this local outcome committed?"""

    terminal: Terminal


Question: TypeAlias = AskBegin | AskEnd | AskCommit
