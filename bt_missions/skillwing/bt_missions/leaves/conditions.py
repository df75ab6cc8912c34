"""Leaves that check the robot: the state of a resource, the value of a datum. They change nothing."""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping
from typing import Any, Literal, TypeAlias

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from skillwing.bt_missions.leaves.blackboard_entry import MissingValueError
from skillwing.bt_missions.leaves.context import MissionContext
from skillwing.bt_missions.leaves.readings import read_latest
from skillwing.bt_missions.leaves.source_location import set_caller_location

Sign: TypeAlias = Literal["==", "!=", "<", "<=", ">", ">="]

_COMPARE: Mapping[Sign, Callable[[Any, Any], bool]] = {
    "==": operator.eq,
    "!=": operator.ne,
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
}
SIGNS = tuple(_COMPARE)


class ResourceIs(Behaviour):
    """SUCCESS while `resource` is in one of `states`.

    Otherwise FAILURE, or with `wait` (seconds of robot time) RUNNING for that long and then FAILURE.
    question: a failure is the answer to a question, and is not recorded as the reason of a later failure. robot: its
    name, in a mission on several robots. The state of a robot that cannot be reached is not known.
    """

    def __init__(
        self,
        name: str,
        context: MissionContext,
        resource: str,
        *states: str,
        wait: float = 0.0,
        question: bool = False,
        robot: str | None = None,
    ) -> None:
        super().__init__(name)
        set_caller_location(self)
        self.resource = resource
        self.states = states
        self._context = context.of(robot)
        self.robot = self._context.robot
        self.skillset = self._context.skillset
        self.wait = wait
        self.question = question
        self._waits_since = 0.0

    def initialise(self) -> None:
        self._waits_since = self._context.now()

    def update(self) -> Status:
        state = None if self._context.absence else self._context.interface.state(self.resource)
        self.feedback_message = f"{self.resource} is {state or 'not known'}"
        if state in self.states:
            return Status.SUCCESS
        if not self._context.absence and self._context.now() - self._waits_since < self.wait:
            return Status.RUNNING
        if not self.question:
            wanted = " or ".join(self.states)
            record = self._context.interface.change_record(self.resource)
            self._context.observe(f"{self.feedback_message}; it has to be {wanted}", record, failed=True)
        return Status.FAILURE


class DataCompare(Behaviour):
    """SUCCESS while the comparison of `datum` with `value` by `sign` holds; `position.z` names a field of a datum.

    FAILURE for a datum that is stale or was never received. robot: its name, in a mission on several robots.
    """

    def __init__(
        self,
        name: str,
        context: MissionContext,
        datum: str,
        sign: Sign,
        value: float | str | bool,
        *,
        robot: str | None = None,
    ) -> None:
        super().__init__(name)
        set_caller_location(self)
        self.datum, *self.fields = datum.split(".")
        self._context = context.of(robot)
        self.robot = self._context.robot
        self.skillset = self._context.skillset
        self.sign: Sign = sign
        self.value = value

    def update(self) -> Status:
        path = ".".join([self.datum, *self.fields])
        try:
            found = read_latest(self._context, self.datum, self.fields)
        except MissingValueError as error:
            return self._fail(str(error))
        if _COMPARE[self.sign](found, self.value):
            self.feedback_message = f"{path} {self.sign} {self.value}"
            return Status.SUCCESS
        return self._fail(f"{path} is {found}; it has to be {self.sign} {self.value}")

    def _fail(self, reason: str) -> Status:
        self.feedback_message = reason
        self._context.observe(reason, None, failed=True)
        return Status.FAILURE
