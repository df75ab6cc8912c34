"""Modifications of running goals: the checks of new inputs, and the refusals of requests."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NoReturn

import msgspec

from skillwing.dsl.model import Skill, UnknownNameError
from skillwing.dsl.suggest import listed
from skillwing.services.core.bounded_dict import GOALS_REMEMBERED, BoundedDict
from skillwing.services.core.checks import unknown_name
from skillwing.services.core.goal_inputs import fitted_inputs
from skillwing.services.core.goal_states import GoalRun, GoalState, Modifying, Running
from skillwing.services.core.refusal import RefusedError
from skillwing.services.core.skill_events import GoalEvent, ModificationRequested, Validated
from skillwing.services.core.values import sendable_text
from skillwing.services.protocol import ErrorCode, ErrorReply, GoalStatus, ModifyGoal, State


class Modifications:
    """The requests for new inputs of one skill's goals, by id: None for an accepted one, or its refusal.

    A known request changes nothing. Requests for unknown goals are kept apart, so that they displace no others.
    """

    def __init__(self, skill: Skill) -> None:
        self._skill = skill
        self._refusals: BoundedDict[str, ErrorReply | None] = BoundedDict(GOALS_REMEMBERED)
        self._of_unknown_goals: BoundedDict[str, ErrorReply | None] = BoundedDict(GOALS_REMEMBERED)

    def __contains__(self, request_id: str) -> bool:
        return request_id in self._refusals or request_id in self._of_unknown_goals

    def refuse(self, request: ModifyGoal, status_of_goal: Callable[[], GoalStatus]) -> NoReturn:
        """Raise RefusedError for a goal that is over, or of which `status_of_goal` raises that nobody knows it.

        The latter is remembered: the goal's start may come before the network repeats the request.
        """
        try:
            state = status_of_goal().state
        except RefusedError as error:
            self._of_unknown_goals[request.request_id] = error.reply
            raise
        raise RefusedError(ErrorCode.NOT_ALLOWED, f"The goal is {state}.", help="Start another one.")

    def require_accepted(self, request_id: str) -> None:
        """Raise RefusedError unless the request was accepted."""
        if request_id not in self:
            raise RefusedError(ErrorCode.UNAVAILABLE, "The new inputs are still being validated.", help="Ask again.")
        refusal = self._refusals.get(request_id) or self._of_unknown_goals.get(request_id)
        if refusal is not None:
            raise RefusedError(refusal.code, refusal.message, help=refusal.help)

    def requested(self, request: ModifyGoal, run: GoalRun) -> ModificationRequested:
        """The event of a request that fits. Raises RefusedError for a goal that does not run, and for wrong inputs."""
        if not isinstance(run.state, Running):
            if run.phase in (State.VALIDATING, State.DISPATCHING) or isinstance(run.state, Modifying):
                raise RefusedError(ErrorCode.UNAVAILABLE, f"The goal is {run.phase}.", help="Ask again when it runs.")
            raise RefusedError(ErrorCode.NOT_ALLOWED, "The goal is about to end.", help="Start another one.")
        inputs = self._merged(run, request)
        changes = (f"`{name}` to {msgspec.json.encode(inputs[name]).decode()}" for name in request.inputs)
        text = sendable_text(f"{request.client} modified {', '.join(changes)}")
        return ModificationRequested(request.request_id, inputs, text, request.cause)

    def _merged(self, run: GoalRun, request: ModifyGoal) -> dict[str, object]:
        """The inputs of a goal with new values among them. Raises RefusedError with every problem of one kind."""
        skill = self._skill
        names = [item.name for item in skill.modifiable]
        if not names:
            text = f"The skillset calls no input of `{skill.name}` modifiable."
            raise RefusedError(ErrorCode.NOT_ALLOWED, text, help="Start another goal.")
        try:
            fixed = [name for name in request.inputs if not skill.input(name).modifiable]
        except UnknownNameError as error:
            raise unknown_name(error) from error
        if fixed or not request.inputs:
            message = f"A goal of `{skill.name}` keeps {listed(fixed)}." if fixed else "No input is named."
            help = f"Modifiable inputs: {listed(names)}."
            raise RefusedError(ErrorCode.NOT_ALLOWED, message, help=help, known=names)
        inputs, reasons = fitted_inputs(skill, {**run.inputs, **request.inputs})
        if reasons:
            reason = sendable_text(" ".join(reasons.values()))
            raise RefusedError(ErrorCode.BAD_REQUEST, reason, help="The goal keeps its own.")
        return inputs

    def inputs_of(self, run: GoalRun) -> Mapping[str, object]:
        """The inputs for a hook: the new ones while they are validated."""
        return run.state.change.inputs if isinstance(run.state, Modifying) else run.inputs

    def apply(self, run: GoalRun, before: GoalState) -> str:
        """Give a goal the inputs that were accepted in the state before. Returns the text of the record."""
        assert isinstance(before, Modifying)
        run.inputs = before.change.inputs
        run.revision += 1
        return before.change.text

    def settle(self, run: GoalRun, before: GoalState, event: GoalEvent) -> None:
        """Remember the answer to the request of the state before, if the goal has left it."""
        if not isinstance(before, Modifying) or isinstance(run.state, Modifying):
            return
        match event:
            case Validated(problem=None):
                refusal = None
            case Validated(problem=str() as problem):
                refusal = _not_allowed(sendable_text(problem), "The goal keeps its own.")
            case _:
                refusal = _not_allowed("The goal was ended before its new inputs counted.", "Start another one.")
        self._refusals[before.change.request_id] = refusal


def _not_allowed(message: str, help: str) -> ErrorReply:
    return ErrorReply(code=ErrorCode.NOT_ALLOWED, message=message, help=help)
