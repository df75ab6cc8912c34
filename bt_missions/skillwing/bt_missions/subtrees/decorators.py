"""What missions wrap around subtrees, beyond py_trees' own decorators."""

from __future__ import annotations

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.decorators import Decorator

from skillwing.bt_missions.leaves.context import MissionContext


class Deadline(Decorator):
    """FAILURE, and the child halted, when the child takes longer than `seconds` of robot time."""

    def __init__(self, name: str, context: MissionContext, seconds: float, child: Behaviour) -> None:
        super().__init__(name, child)
        self._context = context
        self.seconds = seconds
        self._started_at = 0.0

    def initialise(self) -> None:
        self._started_at = self._context.now()

    def update(self) -> Status:
        late = self._context.now() - self._started_at > self.seconds
        if late and self.decorated.status is Status.RUNNING:
            self.feedback_message = f"{self.decorated.name} takes longer than {self.seconds:g} s"
            self._context.learn(self.feedback_message, None, failed=True)
            return Status.FAILURE
        return self.decorated.status
