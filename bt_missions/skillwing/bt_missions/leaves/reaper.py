"""Follows goals on their way out to their end, outside the tick.

A leaf that is halted lets go of its goal at once, but the robot needs time to stop, and until it has stopped the
goal keeps its resources. So does a goal whose manager was lost, until the resource manager has noticed. The reaper
holds these goals, and tells other leaves whom they have to wait for.
"""

from __future__ import annotations

from typing import TypeAlias

from skillwing.bt_missions.leaves.claims import needed_by, taken_by
from skillwing.bt_missions.leaves.interface import GoalView, RobotInterface
from skillwing.dsl.model import Skillset
from skillwing.services.protocol import Ending

Mark: TypeAlias = int
"""A moment, told by how many goals the reaper had seen leave."""


class Reaper:
    """Interrupts the goals given to it and keeps them until they have ended and hold nothing any more."""

    def __init__(self, interface: RobotInterface, skillset: Skillset) -> None:
        self._interface = interface
        self._skillset = skillset
        self._goals: list[GoalView] = []
        self._left = 0

    def take(self, goal: GoalView, cause: str | None = None) -> None:
        """Interrupt `goal` and follow it. One that is over or already here is left alone, unless it was lost."""
        if self._has_left(goal) or any(goal is other for other in self._goals):
            return
        self._goals.append(goal)
        if not goal.done:
            self._interface.interrupt(goal, cause=cause)

    @property
    def unfinished(self) -> tuple[GoalView, ...]:
        """Goals on their way out."""
        still = [goal for goal in self._goals if not self._has_left(goal)]
        self._left += len(self._goals) - len(still)
        self._goals = still
        return tuple(still)

    def mark(self) -> Mark:
        """Remember this moment, for the questions below."""
        _ = self.unfinished  # goals that are over by now left before the mark
        return self._left

    def busy_since(self, mark: Mark) -> bool:
        """Tell whether any goal was on its way out at some time after `mark`: a refusal may have been its doing."""
        return bool(self.unfinished) or self._left > mark

    def unchanged_since(self, mark: Mark) -> bool:
        """Tell whether goals are on their way out and none has left after `mark`: asking again would change nothing."""
        return bool(self.unfinished) and self._left == mark

    def blocking(self, skill: str) -> tuple[GoalView, ...]:
        """Unfinished goals of the same skill, and those that hold a resource which `skill` needs to start."""
        needed = needed_by(self._skillset, skill)
        return tuple(
            goal
            for goal in self.unfinished
            if goal.skill == skill or needed & taken_by(self._skillset, goal.skill).keys()
        )

    def _has_left(self, goal: GoalView) -> bool:
        if goal.terminal is None or goal.terminal.ending is not Ending.LOST:
            return goal.done
        taken = taken_by(self._skillset, goal.skill)
        return not any(self._interface.state(resource) == state for resource, state in taken.items())
