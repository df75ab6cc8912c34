"""`ParallelAll`: children at the same time, each to its own end."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.composites import Composite

from skillwing.bt_missions.leaves.source_location import set_caller_location


class ParallelAll(Composite):
    """Ticks each child until it has ended; the failure of one halts no other.

    SUCCESS if all have succeeded, otherwise FAILURE, when all have ended. Source: `parallel_all_node.h` of
    BehaviorTree.CPP 4, with `max_failures` 1.
    """

    def __init__(self, name: str, children: Sequence[Behaviour]) -> None:
        super().__init__(name, list(children))
        set_caller_location(self)

    def tick(self) -> Iterator[Behaviour]:
        if self.status is not Status.RUNNING:
            for child in self.children:
                child.stop(Status.INVALID)
        for child in self.children:
            if child.status not in (Status.SUCCESS, Status.FAILURE):
                yield from child.tick()
        ends = {child.status for child in self.children}
        if Status.RUNNING in ends:
            self.status = Status.RUNNING
        else:
            self.stop(Status.FAILURE if Status.FAILURE in ends else Status.SUCCESS)
        yield self
