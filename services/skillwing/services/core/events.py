"""Events of the resource manager: everything that can happen to it, as values.

Requests and data samples are events as they arrive. Each event has a tag, so that a file of events can be read back.
"""

from __future__ import annotations

from typing import ClassVar, TypeAlias

import msgspec

from skillwing.services.protocol import (
    AttachManager,
    BeginGoal,
    DataSample,
    EndGoal,
    FireEvent,
    FireExtern,
    RecordOutcome,
    RenewGoal,
)


class ManagerGone(msgspec.Struct, frozen=True, tag="manager_gone"):
    """A manager whose alive token stayed away."""

    manager: str
    reason: str = "its alive token is gone"


class ManagerExited(msgspec.Struct, frozen=True, tag="manager_exited"):
    """A process that its launcher has seen end. record: the launcher's timeline record of that, of robot time `t`."""

    manager: str
    record: str
    t: float


class GoalSilent(msgspec.Struct, frozen=True, tag="goal_silent"):
    """A goal whose grant was not renewed within its lease."""

    goal_id: str
    reason: str


class TimePassed(msgspec.Struct, frozen=True, tag="time_passed"):
    """Passage of robot time alone, at which data may turn stale."""

    step: ClassVar[int] = 0
    """Number of the resource manager's step that an event tells of; this one tells of none."""


class Resumed(msgspec.Struct, frozen=True, tag="resumed"):
    """Start of a process that continues from a predecessor's snapshot; its core's first event."""


Event: TypeAlias = (
    BeginGoal
    | EndGoal
    | RecordOutcome
    | RenewGoal
    | AttachManager
    | FireExtern
    | FireEvent
    | DataSample
    | ManagerGone
    | ManagerExited
    | GoalSilent
    | TimePassed
    | Resumed
)
