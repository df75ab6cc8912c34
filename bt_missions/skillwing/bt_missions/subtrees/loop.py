"""Rounds of a subtree: `loop(WaypointWriter, goto_straight)` of the paper's Figure 10."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.decorators import Decorator


class Until(Decorator):
    """Repeats its child until `done()` holds, which is SUCCESS; a round that fails before that is FAILURE."""

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
        # A round that went well is followed by the next one, at the next tick.
        return Status.FAILURE if round_ is Status.FAILURE else Status.RUNNING
