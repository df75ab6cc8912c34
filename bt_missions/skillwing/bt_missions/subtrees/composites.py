"""Composites of missions: named ways to put subtrees together."""

from __future__ import annotations

from collections.abc import Iterator

from py_trees.behaviour import Behaviour
from py_trees.common import ParallelPolicy, Status
from py_trees.composites import Composite, Parallel, Selector, Sequence

from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.bt_missions.leaves.source_location import set_caller_location


def in_order(name: str, *steps: Behaviour) -> Sequence:
    """One step after the other; a step that has succeeded is not ticked again."""
    return Sequence(name, memory=True, children=steps)


def guarded(name: str, guard: Behaviour, child: Behaviour) -> Sequence:
    """`child`, with `guard` ticked before it at every tick; the child is halted when the guard fails."""
    return Sequence(name, memory=False, children=[guard, child])


def first_that_works(name: str, *branches: Behaviour) -> Selector:
    """The next branch when one has failed; a branch that has failed is not tried again."""
    return Selector(name, memory=True, children=branches)


def alongside(name: str, *companions: Behaviour, until: Behaviour) -> Parallel:
    """`until` with companions at the same time. Its success is that of the whole, and halts the companions. A failure
    of any child is a failure of the whole."""
    policy = ParallelPolicy.SuccessOnSelected(children=[until], synchronise=False)
    return Parallel(name, policy=policy, children=[*companions, until])


class OnEnding(Composite):
    """`attempt`; if a skill in it fails with one of `endings` (labels such as `NR` or `S_BLOCKED`), then `then`.

    The node ends as the child that was ticked last. Any other failure of `attempt` is a failure of the node.
    """

    def __init__(self, name: str, attempt: Behaviour, endings: tuple[str, ...], then: Behaviour) -> None:
        super().__init__(name, [attempt, then])
        set_caller_location(self)
        self.endings = endings
        self._attempt, self._then = attempt, then

    def tick(self) -> Iterator[Behaviour]:
        if self.status is not Status.RUNNING:
            self.current_child = self._attempt
            self._then.stop(Status.INVALID)
        if self.current_child is self._attempt:
            yield from self._attempt.tick()
            if self._attempt.status is Status.FAILURE and self._failed_as_named():
                self.current_child = self._then
        if self.current_child is self._then:
            yield from self._then.tick()
        assert self.current_child is not None
        if self.current_child.status is Status.RUNNING:
            self.status = Status.RUNNING
        else:
            self.stop(self.current_child.status)
        yield self

    def _failed_as_named(self) -> bool:
        leaves = (leaf for leaf in self._attempt.iterate() if isinstance(leaf, SkillAction))
        failed = next((leaf for leaf in leaves if leaf.status is Status.FAILURE), None)
        self.feedback_message = "" if failed is None else f"{failed.skill} ended {failed.ending or 'before it began'}"
        return failed is not None and failed.ending in self.endings
