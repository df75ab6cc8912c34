"""Composites of BehaviorTree.CPP that py_trees does not have: IfThenElse, Switch and SequenceWithMemory.

Their semantics are those of version 4: https://www.behaviortree.dev/docs/nodes-library/ and the headers in
`include/behaviortree_cpp/controls/`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.composites import Composite
from py_trees.composites import Sequence as InOrder

from skillwing.bt_missions.leaves.blackboard_entry import MissingValueError
from skillwing.bt_missions.leaves.source_location import set_caller_location

_EPSILON = 1.2e-7
"""Greatest difference of equal numbers: the one that BehaviorTree.CPP allows, that of a 32-bit float."""


class _Choice(Composite):
    """Composite that runs one of its children at a time, and ends as that child does."""

    def _restart(self) -> None:
        """Halt all children before a new run."""
        self.current_child = None
        for child in self.children:
            if child.status is not Status.INVALID:
                child.stop(Status.INVALID)

    def _follow(self, child: Behaviour) -> None:
        """Take over the status of a child."""
        if child.status is Status.RUNNING:
            self.status = Status.RUNNING
        else:
            self.stop(child.status)


class IfThenElse(_Choice):
    """`then` if the condition succeeds, else `otherwise`; without `otherwise` a failed condition is FAILURE.

    The condition is ticked until it has ended, and not again while a branch runs. Source: `if_then_else_node.h` of
    BehaviorTree.CPP 4.
    """

    def __init__(self, name: str, condition: Behaviour, then: Behaviour, otherwise: Behaviour | None = None) -> None:
        super().__init__(name, [condition, then] if otherwise is None else [condition, then, otherwise])
        set_caller_location(self)

    def tick(self) -> Iterator[Behaviour]:
        condition, then, *otherwise = self.children
        if self.status is not Status.RUNNING:
            self._restart()
        child = self.current_child or condition
        if child is condition:
            yield from condition.tick()
            if condition.status is Status.SUCCESS:
                child = then
            elif condition.status is Status.FAILURE and otherwise:
                child = otherwise[0]
        self.current_child = child
        if child is not condition:
            yield from child.tick()
        self._follow(child)
        yield self


class ValueSwitch(_Choice):
    """The child of the first case that equals `variable`; the last child if no case does.

    variable: a value, or a function that returns it at each tick, such as a BlackboardEntry or a LatestReading. When it
    changes, the child that runs is halted, and another one starts. A variable without a value has no case. Values are
    compared as texts, then as numbers. Source: `switch_node.h` and `switch_node.cpp` of BehaviorTree.CPP 4.
    """

    def __init__(self, name: str, variable: object, cases: Sequence[str], children: Sequence[Behaviour]) -> None:
        if len(children) != len(cases) + 1:
            raise ValueError(f"`{name}` has {len(cases)} cases; it takes a child for each, and one for all else.")
        super().__init__(name, children)
        set_caller_location(self)
        self.variable = variable
        self.cases = tuple(cases)

    def tick(self) -> Iterator[Behaviour]:
        if self.status is not Status.RUNNING:
            self._restart()
        child = self.children[self._chosen()]
        if self.current_child not in (None, child):
            self._restart()
        self.current_child = child
        yield from child.tick()
        self._follow(child)
        yield self

    def _chosen(self) -> int:
        """Number of the child for the present value."""
        default = len(self.cases)
        try:
            value = self.variable() if callable(self.variable) else self.variable
        except MissingValueError as error:
            self.feedback_message = str(error)
            return default
        text = _text(value)
        self.feedback_message = text
        return next((number for number, case in enumerate(self.cases) if _equal(text, case)), default)


class SequenceWithMemory(InOrder):
    """Sequence that starts again with the child that has failed, or was halted, and not with its first one.

    Only after the success of all children it starts with the first one again. Source: `sequence_with_memory_node.cpp`
    of BehaviorTree.CPP 4.
    """

    def __init__(self, name: str, children: Sequence[Behaviour]) -> None:
        super().__init__(name, memory=True, children=children)
        set_caller_location(self)
        self._done = 0

    def tick(self) -> Iterator[Behaviour]:
        if self.status is not Status.RUNNING:
            for child in self.children[self._done :]:
                if child.status is not Status.INVALID:
                    child.stop(Status.INVALID)
        for child in self.children[self._done :]:
            self.current_child = child
            yield from child.tick()
            if child.status is not Status.SUCCESS:
                break
            self._done += 1
        if self._done == len(self.children):
            self._done = 0
            self.stop(Status.SUCCESS)
        elif self.current_child is not None and self.current_child.status is Status.RUNNING:
            self.status = Status.RUNNING
        else:
            self.stop(Status.FAILURE)
        yield self


def _text(value: object) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


def _equal(text: str, case: str) -> bool:
    if text == case:
        return True
    try:
        return abs(float(text) - float(case)) <= _EPSILON
    except ValueError:
        return False
