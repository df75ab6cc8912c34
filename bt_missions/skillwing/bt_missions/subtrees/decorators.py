"""Decorators of missions, in addition to those of py_trees."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from py_trees.behaviour import Behaviour
from py_trees.common import OneShotPolicy, Status
from py_trees.composites import Selector
from py_trees.decorators import Decorator, OneShot

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


class Delay(Decorator):
    """Starts its child after `seconds` of robot time, and ends as the child does. RUNNING until then.

    Source: `delay_node.cpp` of BehaviorTree.CPP 4, where the time is that of the computer.
    """

    def __init__(self, name: str, context: MissionContext, seconds: float, child: Behaviour) -> None:
        super().__init__(name, child)
        self._context = context
        self.seconds = seconds
        self._started_at = 0.0

    def tick(self) -> Iterator[Behaviour]:
        if self.status is not Status.RUNNING:
            if self.decorated.status is not Status.INVALID:
                self.decorated.stop(Status.INVALID)
            self._started_at = self._context.now()
        left = self._started_at + self.seconds - self._context.now()
        if left > 0.0:
            self.feedback_message = f"{self.decorated.name} starts after {self.seconds:g} s"
            self.status = Status.RUNNING
            yield self
        else:
            self.feedback_message = ""
            yield from super().tick()

    def update(self) -> Status:
        return self.decorated.status


class RunOnce(OneShot):
    """Runs its child to one end; afterwards a Sequence or a Fallback around this node skips it.

    To be skipped is SUCCESS here, and FAILURE in a Fallback, as py_trees has no status for it. For the same end each
    time use `OneShot` of py_trees. Source: `run_once_node.h` of BehaviorTree.CPP 4, with `then_skip` true.
    """

    def __init__(self, name: str, child: Behaviour) -> None:
        super().__init__(name, child, OneShotPolicy.ON_COMPLETION)

    @property
    def when_skipped(self) -> Status:
        """Status with which the node above goes on to its next child."""
        return Status.FAILURE if isinstance(self.parent, Selector) else Status.SUCCESS

    def update(self) -> Status:
        if self.final_status is None:
            return self.decorated.status
        self.feedback_message = "skipped, as it has run already"
        return self.when_skipped
