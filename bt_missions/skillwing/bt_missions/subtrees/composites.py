"""The ways in which missions put subtrees together, under names that say what they mean."""

from __future__ import annotations

from py_trees.behaviour import Behaviour
from py_trees.common import ParallelPolicy
from py_trees.composites import Parallel, Selector, Sequence


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
