"""Goals that were cancelled or lost, followed to their end outside the tick.

A halted leaf gives up its goal at once, but the robot needs time to stop. Until then the goal keeps its resources.
So does a goal of a lost manager, until the resource manager has noticed the loss. Other leaves wait for these goals.
"""

from __future__ import annotations

from typing import TypeAlias

from skillwing.bt_missions.leaves.interface import GoalView, RobotInterface
from skillwing.dsl.model import Skillset
from skillwing.dsl.queries import needed_by, taken_by
from skillwing.services.protocol import Ending, Terminal

Mark: TypeAlias = int
"""A moment, as the number of goals that had left the reaper."""


class Reaper:
    """Interrupts the goals that it receives, and keeps each until it has ended and holds no resource."""

    def __init__(self, interface: RobotInterface, skillset: Skillset) -> None:
        self._interface = interface
        self._skillset = skillset
        self._goals: list[GoalView] = []
        self._left = 0

    def take(self, goal: GoalView, cause: str | None = None) -> None:
        """Interrupt `goal` and follow it. A goal that is over or already here is ignored, unless it was lost."""
        if self._has_left(goal) or any(goal is other for other in self._goals):
            return
        self._goals.append(goal)
        if not goal.done:
            self._interface.interrupt(goal, cause=cause)

    @property
    def unfinished(self) -> tuple[GoalView, ...]:
        """Goals that have not ended, or still hold a resource."""
        still = [goal for goal in self._goals if not self._has_left(goal)]
        self._left += len(self._goals) - len(still)
        self._goals = still
        return tuple(still)

    def mark(self) -> Mark:
        """Mark of this moment, for the queries below."""
        _ = self.unfinished  # goals that are over by now left before the mark
        return self._left

    def busy_since(self, mark: Mark) -> bool:
        """True if any goal was here at some time after `mark`: it may be the reason for a refusal."""
        return bool(self.unfinished) or self._left > mark

    def unchanged_since(self, mark: Mark) -> bool:
        """True if goals are here and none has left after `mark`: a second request would be refused as well."""
        return bool(self.unfinished) and self._left == mark

    def blocking(self, skill: str) -> tuple[GoalView, ...]:
        """Unfinished goals of the same skill, and those that hold a resource which `skill` needs to start."""
        needed = needed_by(self._skillset.skill(skill))
        return tuple(
            goal
            for goal in self.unfinished
            if goal.skill == skill or needed & taken_by(self._skillset.skill(goal.skill)).keys()
        )

    def _has_left(self, goal: GoalView) -> bool:
        if goal.terminal is None or goal.terminal.ending is not Ending.LOST:
            return goal.done
        taken = taken_by(self._skillset.skill(goal.skill))
        return not any(self._interface.state(resource) == state for resource, state in taken.items())


class StartRetry:
    """Rule for one leaf: wait until the goals in the reaper leave room for `skill`, and ask again after a refusal.

    py_trees starts a new branch before it halts the old one. A new goal may therefore be refused because of a goal
    that is cancelled only afterwards.
    """

    def __init__(self, skill: str, reaper: Reaper) -> None:
        self._skill = skill
        self._reaper = reaper
        self._sent_at: Mark = 0
        self._refused_at: Mark | None = None

    def begin(self) -> None:
        """Forget the refusals of earlier runs."""
        self._refused_at = None

    def note_start(self) -> None:
        """Note that a goal is about to be sent."""
        self._sent_at = self._reaper.mark()

    def note_refusal(self, terminal: Terminal) -> bool:
        """True for a refusal whose reason may be a goal in the reaper."""
        if terminal.ending not in (Ending.NOT_READY, Ending.BUSY) or not self._reaper.busy_since(self._sent_at):
            return False
        self._refused_at = self._reaper.mark()
        return True

    def holders(self) -> tuple[GoalView, ...]:
        """Goals to wait for: those that block the skill; after a refusal all goals, as any may be the reason."""
        if self._refused_at is not None and self._reaper.unchanged_since(self._refused_at):
            return self._reaper.unfinished
        return self._reaper.blocking(self._skill)
