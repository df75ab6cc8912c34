"""States of a goal in its skill's manager: an exact form of Figure 5 of the paper.

Each state is a type with the fields that exist in it. Its method `on` takes an event and returns a reaction, or
None for an event that changes nothing there. `docs/semantics.md` holds the table of all reactions.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum, auto
from typing import Any, ClassVar, TypeAlias

import msgspec
from msgspec.structs import replace

from skillwing.dsl.model import Skill, UnknownNameError
from skillwing.services.core.events import TimePassed
from skillwing.services.core.goal_inputs import sending_problem
from skillwing.services.core.skill_actions import Hook
from skillwing.services.core.skill_events import (
    Accepted,
    Dispatched,
    Failed,
    GoalEvent,
    ModificationRequested,
    Raised,
    Rejected,
    RenewalAnswered,
    Reply,
    RetriesExhausted,
    StopConfirmed,
    StopRequested,
    Terminated,
    Validated,
)
from skillwing.services.core.values import fit_fields, sendable_text
from skillwing.services.core.verdicts import (
    REVOKED_CODES,
    ROOT,
    record_of,
    terminal_of,
    terminal_of_end,
    terminal_of_revoked,
    terminal_without_grant,
)
from skillwing.services.protocol import (
    LONGEST_LABEL,
    NO_TOKEN,
    BeginGoal,
    Ended,
    EndGoal,
    Ending,
    EndKind,
    ErrorReply,
    GoalStatus,
    Granted,
    Lost,
    RecordOutcome,
    State,
    Terminal,
    Violated,
)

RENEWALS_UNTIL_UNWATCHED = 20
"""Unanswered renewals in a row, 10 s to 12 s of wall time, after which a goal is interrupted: its invariants are not
watched. A resource manager that is started again is back long before that."""


class Ask(Enum):
    """Action of a reaction: put the question of the new state to the resource manager."""

    RESOURCES = auto()


ASK = Ask.RESOURCES
"""The member by its own name: Python 3.11 takes longer to look one up than to make a state."""


Reaction: TypeAlias = "tuple[GoalState, Hook | Ask | None, str | None]"
"""Effect of an event on a goal: the next state, the action, and the timeline record behind it.

A change of the phase is published before the action. The record is None for the goal's own last one, and `ROOT` if no
record led to the event.
"""


# --- states without a grant ----------------------------------------------------------------------------------------


class GoalState(msgspec.Struct, frozen=True):
    """Base of all states.

    phase: the state that clients see; text: its explanation in the timeline. busy: no other goal can start meanwhile.
    question: the kind of question whose answer the goal waits for. token: 0 without a grant.
    """

    phase: ClassVar[State] = State.VALIDATING
    busy: ClassVar[bool] = True
    question: ClassVar[type[BeginGoal | EndGoal | RecordOutcome] | None] = None
    token: ClassVar[int] = NO_TOKEN
    terminal: ClassVar[Terminal | None] = None

    @property
    def text(self) -> str:
        return ""

    def on(self, event: GoalEvent, skill: Skill, now: float) -> Reaction | None:
        """The reaction to an event at robot time `now`; None if the event changes nothing."""
        raise NotImplementedError


class Idle(GoalState, frozen=True):
    """State before the start."""

    def on(self, event: GoalEvent, skill: Skill, now: float) -> Reaction | None:
        match event:
            case Accepted():
                return Validating(), Hook.VALIDATE, None
            case Rejected(terminal=terminal):
                return Committing(terminal, State.VALIDATING), ASK, None
            case _:
                return None


class Validating(GoalState, frozen=True):
    """The developer's `validate` runs."""

    @property
    def failure_cause(self) -> str | None:
        """Cause of an exception: the request to stop, if there was one."""
        return ROOT

    def on(self, event: GoalEvent, skill: Skill, now: float) -> Reaction | None:
        match event:
            case Validated(problem=None):
                return Asking(), ASK, None
            case StopRequested(reason=reason, cause=cause):
                return ValidatingCancelled(reason), None, cause or ROOT
            case _:
                return self.reject(event)

    def reject(self, event: GoalEvent) -> Reaction | None:
        """The end of a goal that never asks for a grant."""
        match event:
            case Validated(problem=str() as problem):
                return self.commit(Terminal(ending=Ending.NOT_VALIDATED, reason=sendable_text(problem)))
            case Raised():
                return self.commit(Terminal(ending=Ending.ERROR, reason=_raised(event)), self.failure_cause)
            case Violated() | Lost():
                return Finished(terminal_of(event)), None, event.record
            case _:
                return None

    def commit(self, terminal: Terminal, cause: str | None = None) -> Reaction:
        return Committing(terminal, self.phase), ASK, cause


class ValidatingCancelled(Validating, frozen=True):
    """The developer's `validate` runs for a goal that is to stop. reason: why."""

    phase: ClassVar[State] = State.INTERRUPTING
    reason: str

    @property
    def text(self) -> str:
        return self.reason

    @property
    def failure_cause(self) -> str | None:
        return None

    def on(self, event: GoalEvent, skill: Skill, now: float) -> Reaction | None:
        match event:
            case Validated(problem=None):
                return self.commit(Terminal(ending=Ending.INTERRUPTED, reason=self.reason))
            case _:
                return self.reject(event)


class Committing(GoalState, frozen=True):
    """The goal waits until its local outcome is committed. It keeps its phase."""

    busy: ClassVar[bool] = False
    question: ClassVar[type[RecordOutcome] | None] = RecordOutcome
    outcome: Terminal
    phase: State  # pyright: ignore[reportIncompatibleVariableOverride] - in other states it is given by the type

    def on(self, event: GoalEvent, skill: Skill, now: float) -> Reaction | None:
        match event:
            case Reply(answer=answer):
                return Finished(terminal_without_grant(answer, skill)), None, record_of(answer)
            case RetriesExhausted():
                return Finished(_no_answer(self.outcome.reason)), None, ROOT
            case _:
                return None


class Asking(GoalState, frozen=True):
    """The goal waits for its grant."""

    question: ClassVar[type[BeginGoal] | None] = BeginGoal

    def on(self, event: GoalEvent, skill: Skill, now: float) -> Reaction | None:
        match event:
            case Reply(answer=Granted() as grant):
                deadline = None if skill.deadline is None else now + skill.deadline
                return Dispatching(grant.token, deadline), Hook.DISPATCH, grant.record
            case StopRequested(reason=reason, cause=cause):
                return AskingCancelled(reason), None, cause or ROOT
            case _:
                return self.fail(event, skill)

    def fail(self, event: GoalEvent, skill: Skill) -> Reaction | None:
        """The end of a goal that gets no grant."""
        match event:
            case Reply(answer=answer):
                return Finished(terminal_without_grant(answer, skill)), None, record_of(answer)
            case RetriesExhausted():
                return Finished(_no_answer()), None, ROOT
            case Violated() | Lost():
                return Finished(terminal_of(event)), None, event.record
            case _:
                return None


class AskingCancelled(Asking, frozen=True):
    """The goal waits for its grant, to give it back at once. reason: why it is to stop."""

    phase: ClassVar[State] = State.INTERRUPTING
    reason: str

    @property
    def text(self) -> str:
        return self.reason

    def on(self, event: GoalEvent, skill: Skill, now: float) -> Reaction | None:
        match event:
            case Reply(answer=Granted(token=token)):
                state = GivingBack(token, EndKind.INTERRUPT, self.reason, State.INTERRUPTING)
                return state, ASK, None
            case _:
                return self.fail(event, skill)


# --- states with a grant -------------------------------------------------------------------------------------------


class Holding(GoalState, frozen=True):
    """Base of the states in which the goal holds a grant. token: its fencing token."""

    token: int  # pyright: ignore[reportIncompatibleVariableOverride] - the others have none

    def finish(self, terminal: Terminal, cause: str | None = None) -> Reaction:
        return Finished(terminal), Hook.ENDED, cause

    def revoke(self, event: GoalEvent) -> Reaction | None:
        """The end of a goal that the resource manager has taken the grant from."""
        match event:
            case Violated() | Lost():
                return self.finish(terminal_of(event), event.record)
            case RenewalAnswered(answer=Ended() | Violated() | Lost() as verdict):
                return self.finish(terminal_of_revoked(verdict), verdict.record)
            case RenewalAnswered(answer=ErrorReply(code=code) as refusal) if code in REVOKED_CODES:
                return self.finish(terminal_of_revoked(refusal), ROOT)
            case _:
                return None


class Executing(Holding, frozen=True):
    """Base of the states in which nothing has ended the goal yet. deadline: robot time of its next timeout."""

    deadline: float | None

    @property
    def failure_cause(self) -> str | None:
        """Cause of a failure whose developer names none: the request to stop, if there was one."""
        return None

    def end(self, event: GoalEvent, skill: Skill) -> Reaction | None:
        """The end of a goal by its developer, or by the resource manager."""
        match event:
            case Terminated():
                return self.end_with_result(event, skill)
            case Failed(reason=reason, cause=cause):
                return self.ask_end(EndKind.ERROR, reason, cause=cause or self.failure_cause)
            case Raised():
                return self.ask_end(EndKind.ERROR, _raised(event), cause=self.failure_cause)
            case _:
                return self.revoke(event)

    def end_with_result(self, event: Terminated, skill: Skill) -> Reaction:
        """The end that the developer names; an error if the skillset has no such result or output."""
        cause = event.cause or self.failure_cause
        try:
            result = skill.result(event.result)
        except UnknownNameError as error:
            return self.ask_end(EndKind.ERROR, str(error), cause=cause)
        given = {name: value for name, value in (event.output or {}).items() if value is not None}
        fitted, problems = fit_fields(skill.outputs, given)
        wrong = [problem.sentence for problem in problems if problem.kind in ("type", "unknown")]
        if wrong:
            reason = f"The output of {event.result} does not fit the skillset: {' '.join(wrong)}"
            return self.ask_end(EndKind.ERROR, reason, cause=cause)
        if (problem := sending_problem(fitted)) is not None:
            reason = f"The output of {event.result} cannot be sent: {problem}."
            return self.ask_end(EndKind.ERROR, reason, cause=cause)
        output = fitted if event.output is not None else None
        reason = f"The skill ended with {event.result}{f': {event.why}' if event.why else ''}."
        cause = event.cause if result.success else cause
        return self.ask_end(EndKind.RESULT, reason, cause=cause, result=event.result, output=output)

    def ask_end(
        self,
        how: EndKind,
        reason: str,
        *,
        cause: str | None = None,
        result: str | None = None,
        output: dict[str, Any] | None = None,
        forced: bool = False,
    ) -> Reaction:
        """Ask for the effect of an end; the answer decides how the goal has ended."""
        if cause is not None:
            cause = sendable_text(cause)[:LONGEST_LABEL]
        return Finishing(self.token, how, sendable_text(reason), self.phase, result, output, forced, cause), ASK, cause


class Unstopped(Executing, frozen=True):
    """Base of the states without a request to stop. silences: number of unanswered renewals in a row."""

    silences: int = 0

    @property
    def failure_cause(self) -> str | None:
        return ROOT

    def on(self, event: GoalEvent, skill: Skill, now: float) -> Reaction | None:
        match event:
            case RenewalAnswered(answer=Granted()):
                return replace(self, silences=0), None, None
            case StopRequested(reason=reason, cause=cause):
                return self.stop(reason, cause, skill, now)
            case TimePassed():
                if self.deadline is None or now < self.deadline:
                    return None
                return self.stop(f"Its deadline of {skill.deadline:g} s passed.", None, skill, now)
            case RenewalAnswered():
                return self.revoke(event) or self.count_silence(event, skill, now)
            case _:
                return self.end(event, skill)

    def count_silence(self, event: RenewalAnswered, skill: Skill, now: float) -> Reaction | None:
        """Count unanswered renewals. After too many in a row the goal's invariants are not watched: interrupt it."""
        if not (event.answer is None or isinstance(event.answer, ErrorReply)):
            return None
        if self.silences + 1 >= RENEWALS_UNTIL_UNWATCHED:
            return self.stop("The resource manager is silent, and nobody watches the invariants.", None, skill, now)
        return replace(self, silences=self.silences + 1), None, None

    def stop(self, reason: str, cause: str | None, skill: Skill, now: float) -> Reaction:
        """First phase of an interrupt: ask the skill to stop. The goal keeps its grant until the skill has stopped."""
        state = Stopping(self.token, now + skill.interrupt.timeout, reason)
        return state, Hook.INTERRUPT, cause or ROOT


class Dispatching(Unstopped, frozen=True):
    """The developer's `on_dispatch` runs."""

    phase: ClassVar[State] = State.DISPATCHING

    def on(self, event: GoalEvent, skill: Skill, now: float) -> Reaction | None:
        if isinstance(event, Dispatched):
            return Running(self.token, self.deadline, self.silences), None, None
        return super().on(event, skill, now)


class Running(Unstopped, frozen=True):
    """The skill runs."""

    phase: ClassVar[State] = State.RUNNING

    def on(self, event: GoalEvent, skill: Skill, now: float) -> Reaction | None:
        if isinstance(event, ModificationRequested):
            return Modifying(self.token, self.deadline, self.silences, change=event), Hook.VALIDATE, None
        return super().on(event, skill, now)


class Modifying(Unstopped, frozen=True, kw_only=True):
    """The skill runs, and the developer's `validate` judges new inputs. change: they."""

    phase: ClassVar[State] = State.RUNNING
    change: ModificationRequested

    def on(self, event: GoalEvent, skill: Skill, now: float) -> Reaction | None:
        match event:
            case Validated(problem=None):
                return self.resume(), Hook.MODIFY, self.change.cause or ROOT
            case Validated():
                return self.resume(), None, None
            case _:
                return super().on(event, skill, now)

    def resume(self) -> Running:
        return Running(self.token, self.deadline, self.silences)


class Stopping(Executing, frozen=True):
    """The skill was asked to stop. reason: why; deadline: robot time at which the end is forced."""

    phase: ClassVar[State] = State.INTERRUPTING
    reason: str

    @property
    def text(self) -> str:
        return self.reason

    def on(self, event: GoalEvent, skill: Skill, now: float) -> Reaction | None:
        match event:
            case StopConfirmed():
                return self.ask_end(EndKind.INTERRUPT, self.reason)
            case TimePassed():
                if self.deadline is None or now < self.deadline:
                    return None
                limit = f"{skill.interrupt.timeout:g} s"
                reason = f"{self.reason} The skill did not confirm within {limit} that it has stopped."
                return self.ask_end(EndKind.INTERRUPT, reason, forced=True)
            case _:
                return self.end(event, skill)


class Finishing(Holding, frozen=True):
    """The goal waits until the effect of its end is applied. Fields as in `Executing.ask_end`, cause as in `Reaction`.

    It keeps its phase, except that `on_dispatch` may return only now: that hook may end its own goal.
    """

    question: ClassVar[type[EndGoal] | None] = EndGoal
    how: EndKind
    reason: str
    phase: State  # pyright: ignore[reportIncompatibleVariableOverride] - in other states it is given by the type
    result: str | None = None
    output: dict[str, Any] | None = None
    forced: bool = False
    cause: str | None = None

    def on(self, event: GoalEvent, skill: Skill, now: float) -> Reaction | None:
        match event:
            case Reply(answer=Ended() as ended) | RenewalAnswered(answer=Ended() as ended):
                reason = self.reason if ended.held else f"{self.reason} {ended.reason}"
                terminal = terminal_of_end(
                    ended, self.how, self.result, reason, skill, output=self.output, forced=self.forced
                )
                return self.finish(terminal, ended.record)
            case Reply(answer=answer):
                return self.finish(terminal_of_revoked(answer), record_of(answer))
            case RetriesExhausted():
                return self.finish(_no_answer(self.reason), self.failure_cause(skill))
            case Dispatched() if self.phase is State.DISPATCHING:
                return replace(self, phase=State.RUNNING), None, None
            case _:
                return self.revoke(event)

    def failure_cause(self, skill: Skill) -> str | None:
        """Cause of an end without an answer: that of the end which was asked for, unless it was a success."""
        return ROOT if self.result is not None and skill.result(self.result).success else self.cause


class GivingBack(Finishing, frozen=True):
    """The goal gives back a grant that arrived after the request to stop. It was never dispatched."""

    def finish(self, terminal: Terminal, cause: str | None = None) -> Reaction:
        return Finished(terminal), None, cause


# --- the end -------------------------------------------------------------------------------------------------------


class Finished(GoalState, frozen=True):
    """The goal has its terminal answer."""

    phase: ClassVar[State] = State.TERMINATED
    busy: ClassVar[bool] = False
    terminal: Terminal  # pyright: ignore[reportIncompatibleVariableOverride] - the only state that has one

    @property
    def text(self) -> str:
        return self.terminal.reason

    def on(self, event: GoalEvent, skill: Skill, now: float) -> Reaction | None:
        return None


@dataclass(slots=True)
class GoalRun:
    """A goal with its state. owner: the client process that it must not outlive, None for any. owner_grace: wall time
    in seconds for which it runs on without its owner.

    record: its latest timeline record; step: number of the resource manager's step that it follows from; revision:
    number of its modifications; status: as last published.
    """

    goal_id: str
    inputs: Mapping[str, object]
    client: str
    owner: str | None
    started_at: float
    state: GoalState
    record: str | None
    step: int = 0
    revision: int = 0
    status: GoalStatus | None = None
    owner_grace: float = 0.0

    @property
    def phase(self) -> State:
        """The state that clients see."""
        return self.state.phase


def _raised(event: Raised) -> str:
    return sendable_text(f"`{event.hook}` of the skill manager raised {event.text}")


def _no_answer(reason: str = "") -> Terminal:
    return Terminal(ending=Ending.ERROR, reason=f"The resource manager does not answer. {reason}".rstrip())
