"""Leaf that asks whether a skill may start. It starts nothing."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from skillwing.bt_missions.leaves.blackboard_entry import MissingValueError
from skillwing.bt_missions.leaves.context import MissionContext
from skillwing.bt_missions.leaves.skill_inputs import plain_inputs
from skillwing.bt_missions.leaves.source_location import set_caller_location
from skillwing.dsl.model import UnknownNameError
from skillwing.services.bus import Answer, Answered, Refused
from skillwing.services.errors import InvalidInputError
from skillwing.services.protocol import ErrorCode, ProtocolError, ReadyReport, SkillReady, decode
from skillwing.services.ready_reasons import reasons

ANSWER_PATIENCE = 5.0
"""Longest wait for an answer of the resource manager, in seconds of robot time."""


class MayStart(Behaviour):
    """SUCCESS if the skill may start now, else FAILURE with everything that is missing.

    The leaf is RUNNING until the resource manager has answered, for `ANSWER_PATIENCE` at most. With `wait` (seconds of
    robot time) it asks again for that long. The hook `validate` is not called, so that a start may still end NV.

    inputs: value of each input of the skill, or a function that returns it; None asks without inputs. question: a
    failure is the answer to a question, and is not recorded as the reason of a later failure. robot: its name, in a
    mission on several robots.
    """

    def __init__(
        self,
        name: str,
        context: MissionContext,
        skill: str,
        inputs: Mapping[str, Any] | None = None,
        *,
        wait: float = 0.0,
        question: bool = False,
        robot: str | None = None,
    ) -> None:
        super().__init__(name)
        set_caller_location(self)
        self._context = context.of(robot)
        self.robot = self._context.robot
        self.skillset = self._context.skillset
        self.skill = skill
        self.inputs = None if inputs is None else plain_inputs(inputs)
        self.wait = wait
        self.question = question
        self._asked_since = 0.0
        self._number = 0
        self._answer: Answer | None = None
        self._problem = ""

    def initialise(self) -> None:
        self._asked_since = self._context.now()
        self.feedback_message = f"asks whether {self.skill} may start"
        self._ask()

    def update(self) -> Status:
        ready = self._ready()
        if isinstance(ready, SkillReady) and ready.ready:
            self.feedback_message = f"{self.skill} may start"
            return Status.SUCCESS
        final = isinstance(ready, str)
        if isinstance(ready, SkillReady):
            self.feedback_message = f"{self.skill} may not start: {' '.join(reasons(ready))}"
        elif ready is not None:
            self.feedback_message = f"{self.skill} may not start: {ready}"
        patience = self.wait if ready is not None else max(self.wait, ANSWER_PATIENCE)
        if not (final or self._context.absence) and self._context.now() - self._asked_since < patience:
            if self._answer is not None:
                self._ask()
            return Status.RUNNING
        if ready is None:
            reason = self._context.absence or "the resource manager does not answer"
            self.feedback_message = f"{self.skill} may not start: {reason}"
        if not self.question:
            self._context.observe(self.feedback_message, self._record(ready), failed=True)
        return Status.FAILURE

    def terminate(self, new_status: Status) -> None:
        self._number += 1  # a late answer is not for the next run

    def _ask(self) -> None:
        self._number += 1
        number, self._answer = self._number, None

        def receive(answer: Answer) -> None:
            if number == self._number:
                self._answer = answer

        try:
            inputs = self.inputs
            if inputs is not None:
                inputs = {name: value() if callable(value) else value for name, value in inputs.items()}
            self._problem = ""
            self._context.interface.ask_ready(self.skill, receive, inputs)
        except (UnknownNameError, InvalidInputError, MissingValueError, ProtocolError) as error:
            self._problem = str(error)

    def _ready(self) -> SkillReady | str | None:
        """The answer; a sentence if there is none and never will be, None if there is none yet."""
        if self._problem:
            return self._problem
        match self._answer:
            case Answered(payload=payload):
                try:
                    return decode(payload, ReadyReport).skills[0]
                except (ProtocolError, IndexError) as error:
                    return f"the answer is unreadable: {error}"
            case Refused(error=error) if error.code is not ErrorCode.UNAVAILABLE:
                return error.message
            case _:
                return None

    def _record(self, ready: SkillReady | str | None) -> str | None:
        """The last change of the first resource that is missing."""
        if not isinstance(ready, SkillReady):
            return None
        names = [missing.resource for check in ready.failing for missing in check.missing]
        return self._context.interface.change_record(names[0]) if names else None
