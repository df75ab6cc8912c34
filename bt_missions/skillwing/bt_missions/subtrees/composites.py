"""The ways in which missions put subtrees together, under names that say what they mean."""

from __future__ import annotations

from collections.abc import Iterator

from py_trees.behaviour import Behaviour
from py_trees.common import ParallelPolicy, Status
from py_trees.composites import Composite, Parallel, Selector, Sequence

from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.bt_missions.leaves.source_location import set_caller_location


def in_order(name: str, *steps: Behaviour) -> Sequence:
    """One step after the other; a step that is done is not looked at again."""
    return Sequence(name, memory=True, children=steps)


def guarded(name: str, guard: Behaviour, child: Behaviour) -> Sequence:
    """`child`, with `guard` asked anew at every tick; it is halted as soon as the guard fails."""
    return Sequence(name, memory=False, children=[guard, child])


def first_that_works(name: str, *branches: Behaviour) -> Selector:
    """The next branch when one has failed; there is no way back to a branch that failed."""
    return Selector(name, memory=True, children=branches)


def alongside(name: str, *companions: Behaviour, until: Behaviour) -> Parallel:
    """`until` decides: when it succeeds, so does the whole, and the companions are halted. A companion that fails
    fails the whole at once."""
    policy = ParallelPolicy.SuccessOnSelected(children=[until], synchronise=False)
    return Parallel(name, policy=policy, children=[*companions, until])


class OnEnding(Composite):
    """`attempt`, and if a skill in it fails with one of `endings` (labels such as `NR` or `S_BLOCKED`), `then` instead.

    It ends as the one of the two that was ticked last; any other failure of `attempt` is its own.
    """

    def __init__(self, name: str, attempt: Behaviour, endings: tuple[str, ...], then: Behaviour) -> None:
        super().__init__(name, [attempt, then])
        set_caller_location(self)
        self.endings = endings
        self._attempt, self._then = attempt, then

    @property
    def skills(self) -> list[str]:
        """Skills whose endings are looked at."""
        return [leaf.skill for leaf in self._attempt.iterate() if isinstance(leaf, SkillAction)]

    def tick(self) -> Iterator[Behaviour]:
        if self.status is not Status.RUNNING:
            self.current_child = self._attempt
            self._then.stop(Status.INVALID)
        if self.current_child is self._attempt:
            yield from self._attempt.tick()
            if self._attempt.status is Status.FAILURE and self._is_meant():
                self.current_child = self._then
        if self.current_child is self._then:
            yield from self._then.tick()
        assert self.current_child is not None
        if self.current_child.status is Status.RUNNING:
            self.status = Status.RUNNING
        else:
            self.stop(self.current_child.status)
        yield self

    def _is_meant(self) -> bool:
        leaves = (leaf for leaf in self._attempt.iterate() if isinstance(leaf, SkillAction))
        failed = next((leaf for leaf in leaves if leaf.status is Status.FAILURE), None)
        self.feedback_message = "" if failed is None else f"{failed.skill} ended {failed.ending or 'before it began'}"
        return failed is not None and failed.ending in self.endings
