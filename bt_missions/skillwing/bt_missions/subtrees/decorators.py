"""Decorators of missions, in addition to those of py_trees."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.decorators import Decorator

from skillwing.bt_missions.leaves.context import MissionContext


class Deadline(Decorator):
    """Halts its child and is FAILURE when the child takes longer than `seconds` of robot time."""

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
            self._context.observe(self.feedback_message, None, failed=True)
            return Status.FAILURE
        return self.decorated.status


class RepeatUntil(Decorator):
    """Repeats its child until `done()` is True, which is SUCCESS. A round that fails before is FAILURE.

    This is `loop(WaypointWriter, goto_straight)` of the paper's Figure 10.
    """

    def __init__(self, name: str, done: Callable[[], bool], child: Behaviour) -> None:
        super().__init__(name, child)
        self.done = done

    def tick(self) -> Iterator[Behaviour]:
        between_rounds = self.decorated.status is not Status.RUNNING
        if between_rounds and self.done():
            self.stop(Status.SUCCESS)
            yield self
        else:
            yield from super().tick()

    def update(self) -> Status:
        round_ = self.decorated.status
        if round_ is not Status.RUNNING and self.done():
            return Status.SUCCESS
        # After a successful round the next one starts at the next tick.
        return Status.FAILURE if round_ is Status.FAILURE else Status.RUNNING
