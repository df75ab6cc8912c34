"""Nodes that may run their children more than once in a run of their own."""

from __future__ import annotations

from collections.abc import Iterator

from py_trees.behaviour import Behaviour
from py_trees.composites import Selector, Sequence
from py_trees.decorators import FailureIsSuccess, Inverter, OneShot, SuccessIsFailure

from skillwing.bt_missions.subtrees.composites import OnEnding
from skillwing.bt_missions.subtrees.decorators import Deadline, Delay
from skillwing.bt_missions.subtrees.flow_control import IfThenElse
from skillwing.bt_missions.subtrees.pausing import WhileGranted

_ONCE = (OnEnding, IfThenElse, Inverter, FailureIsSuccess, SuccessIsFailure, OneShot, Deadline, Delay, WhileGranted)


def repeats(node: Behaviour) -> bool:
    """True if a node may start a child again that has ended: loops, reactive nodes, and those of unknown types."""
    if isinstance(node, Sequence | Selector):
        return not node.memory
    return not isinstance(node, _ONCE)


def above(node: Behaviour) -> Iterator[Behaviour]:
    """All nodes above a node, the nearest first."""
    while node.parent is not None:
        node = node.parent
        yield node


def may_run_again(node: Behaviour) -> bool:
    """True if a node may start again after its end, in the same run of its tree."""
    return any(repeats(each) for each in above(node))
