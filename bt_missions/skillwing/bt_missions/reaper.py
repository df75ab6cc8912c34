"""Follows cancelled goals to their end, outside the tick.

A leaf that is halted lets go of its goal at once, but the robot needs time to stop, and until it has stopped the
goal keeps its resources. The reaper holds these goals, and tells other leaves whom they have to wait for.
"""

from __future__ import annotations

from typing import TypeAlias

from skillwing.dsl.expressions import names_used
from skillwing.dsl.model import Skillset

from .skills import Goal, Interface

Mark: TypeAlias = int
"""A moment, told by how many goals the reaper had seen end."""


class Reaper:
    """Interrupts the goals given to it and keeps them until they are terminal."""

    def __init__(self, interface: Interface, skillset: Skillset) -> None:
        self._interface = interface
        self._skillset = skillset
        self._goals: list[Goal] = []
        self._ended = 0

    def take(self, goal: Goal, cause: str | None = None) -> None:
        """Interrupt `goal` and follow it. A goal that is over or already here is left alone."""
        if goal.done or any(goal is other for other in self._goals):
            return
        self._goals.append(goal)
        self._interface.interrupt(goal, cause=cause)

    @property
    def unfinished(self) -> tuple[Goal, ...]:
        """Goals that were told to stop and have not ended yet."""
        still = [goal for goal in self._goals if not goal.done]
        self._ended += len(self._goals) - len(still)
        self._goals = still
        return tuple(still)

    def mark(self) -> Mark:
        """Remember this moment, for `busy_since`."""
        _ = self.unfinished  # goals that are over by now ended before the mark
        return self._ended

    def busy_since(self, mark: Mark) -> bool:
        """Tell whether any goal was being reaped at some time after `mark`: a refusal may have been its doing."""
        return bool(self.unfinished) or self._ended > mark

    def in_the_way_of(self, skill: str) -> tuple[Goal, ...]:
        """Unfinished goals of the same skill, and those that hold a resource which `skill` needs to start."""
        needed = _needed_by(self._skillset, skill)
        return tuple(
            goal for goal in self.unfinished if goal.skill == skill or needed & _taken_by(self._skillset, goal.skill)
        )


def _taken_by(skillset: Skillset, skill: str) -> frozenset[str]:
    """Resources that a goal of `skill` changed at its start, and gives back when it ends."""
    model = skillset.skill(skill)
    return frozenset(resource for resource, _ in model.transitions(model.preconditions.success))


def _needed_by(skillset: Skillset, skill: str) -> frozenset[str]:
    """Resources whose states decide whether `skill` may start."""
    checks = skillset.skill(skill).preconditions.checks
    return frozenset[str]().union(*(names_used(check.expression, "resource") for check in checks))
