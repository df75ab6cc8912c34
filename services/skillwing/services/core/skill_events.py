"""Events of a skill's manager: everything that can happen to its goals, as values.

Requests of clients and verdicts of the resource manager are events as they arrive.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, TypeAlias

import msgspec

from skillwing.services.core.events import TimePassed
from skillwing.services.core.skill_actions import AskResources
from skillwing.services.protocol import (
    ErrorReply,
    GoalVerdict,
    InterruptGoal,
    Lost,
    ModifyGoal,
    NodesExited,
    RenewGoal,
    StartGoal,
    Terminal,
    Violated,
)


class OwnNews(msgspec.Struct, frozen=True):
    """Base of events that bring no news of the resource manager. step: its step that an event tells of, 0 for none."""

    step: ClassVar[int] = 0


ResourcesAnswer: TypeAlias = GoalVerdict | ErrorReply | None
"""An answer of the resource manager; None for silence."""


# --- from clients --------------------------------------------------------------------------------------------------


class OwnerGone(msgspec.Struct, frozen=True):
    """A client process is gone. owner: its process name; exited: the exit of that process, as far as it is known."""

    owner: str
    exited: NodesExited | None = None


# --- from the hooks ------------------------------------------------------------------------------------------------


class Validated(OwnNews, frozen=True):
    """Return of the developer's `validate`: None, or a sentence about what is wrong with the goal."""

    goal_id: str
    problem: str | None = None


class Dispatched(OwnNews, frozen=True):
    """Return of the developer's `on_dispatch`."""

    goal_id: str


class Raised(OwnNews, frozen=True):
    """Exception in a hook of the developer. text: its type and message."""

    goal_id: str
    hook: str
    text: str


class Terminated(OwnNews, frozen=True):
    """End of the skill by itself. cause: the timeline record that ended it, if the developer names one.

    why: a phrase for the reason.
    """

    goal_id: str
    result: str
    output: Mapping[str, object] | None = None
    cause: str | None = None
    why: str = ""


class StopConfirmed(OwnNews, frozen=True):
    """Confirmation by the developer that an interrupted goal has really stopped."""

    goal_id: str


class Failed(OwnNews, frozen=True):
    """End of the goal as an error, by the developer. cause: as in `Terminated`."""

    goal_id: str
    reason: str
    cause: str | None = None


# --- from the resource manager -------------------------------------------------------------------------------------


class QuestionAnswered(msgspec.Struct, frozen=True):
    """Answer to a question, or silence."""

    asked: AskResources
    answer: ResourcesAnswer


class RenewalAnswered(msgspec.Struct, frozen=True):
    """Answer to a renewal, or silence."""

    call: RenewGoal
    answer: ResourcesAnswer

    @property
    def goal_id(self) -> str:
        return self.call.goal_id

    @property
    def step(self) -> int:
        return 0 if self.answer is None or isinstance(self.answer, ErrorReply) else self.answer.step


CurrentGoalEvent: TypeAlias = (
    Validated | Dispatched | Raised | Terminated | StopConfirmed | Failed | RenewalAnswered | Violated | Lost
)
"""Events that name a goal, and count only while it is the current one."""
Event: TypeAlias = StartGoal | InterruptGoal | ModifyGoal | OwnerGone | CurrentGoalEvent | QuestionAnswered | TimePassed
"""Events that `SkillCore.step` takes."""


# --- the same for one goal -----------------------------------------------------------------------------------------


class Accepted(OwnNews, frozen=True):
    """The start of a goal whose inputs fit, while no other goal runs."""


class Rejected(OwnNews, frozen=True):
    """The start of a goal that this process cannot run. terminal: its local outcome."""

    terminal: Terminal


class StopRequested(OwnNews, frozen=True):
    """Request to stop: an interrupt, or a lost owner. cause: the timeline record behind it, if there is one."""

    reason: str
    cause: str | None = None


class ModificationRequested(OwnNews, frozen=True):
    """Request for new inputs. inputs: all of the goal's inputs, fitted. text, cause: of the timeline record."""

    request_id: str
    inputs: Mapping[str, object]
    text: str
    cause: str | None = None


class Reply(msgspec.Struct, frozen=True):
    """Answer to the question that the goal waits for."""

    answer: GoalVerdict | ErrorReply

    @property
    def step(self) -> int:
        return 0 if isinstance(self.answer, ErrorReply) else self.answer.step


class RetriesExhausted(OwnNews, frozen=True):
    """The tenth silence to the question that the goal waits for."""


GoalEvent: TypeAlias = (
    Accepted
    | Rejected
    | StopRequested
    | ModificationRequested
    | CurrentGoalEvent
    | Reply
    | RetriesExhausted
    | RenewalAnswered
    | TimePassed
)
"""Events that the state of a goal takes."""
