"""Context that the leaves of one mission share: robot, robot time, and the latest observation.

The context also carries causes. A leaf reports each change that it sees (`observe`). The next goal that the tree
starts or interrupts names the record of that change as its cause. A tree is ticked on one thread, so the latest
observation is what the tree reacts to.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from skillwing.bt_missions.leaves.interface import GoalView, RobotInterface
from skillwing.bt_missions.leaves.reaper import Reaper
from skillwing.dsl.model import Skillset
from skillwing.services.rescue_goal import RescueGoal


class RecordWriter(Protocol):
    """Writes one mission record to the timeline and returns its id."""

    def __call__(self, subject: str, before: str | None, after: str, text: str, cause: str | None) -> str: ...


@dataclass(frozen=True, slots=True)
class LeafFailure:
    """Reason of a leaf's failure: a sentence, and the timeline record of the change behind it."""

    text: str
    record: str | None


@dataclass(frozen=True, slots=True)
class BranchSwitch:
    """A switch of the tree from one branch of `subject` to another, at robot time `t`. record: its timeline record."""

    subject: str
    before: str
    after: str
    t: float
    reason: str
    record: str


class MissionContext:
    """Shared by all leaves of one mission. now: robot time in seconds. rescue_goal: of the robot, if it has one."""

    def __init__(
        self,
        interface: RobotInterface,
        skillset: Skillset,
        now: Callable[[], float],
        write_record: RecordWriter,
        rescue_goal: RescueGoal | None = None,
    ) -> None:
        self.interface = interface
        self.skillset = skillset
        self.now = now
        self.rescue_goal = rescue_goal
        self.reaper = Reaper(interface, skillset)
        self.switches: list[BranchSwitch] = []
        self.failure: LeafFailure | None = None
        self.last_observation = ""
        self._write_record = write_record
        self._cause: str | None = None
        self._live: list[GoalView] = []

    def observe(self, text: str, record: str | None, *, failed: bool = False) -> None:
        """Note a change that a leaf has seen. failed: the change made the leaf fail."""
        self._cause = record or self._cause
        self.last_observation = text
        if failed:
            self.failure = LeafFailure(text, record)

    def start(self, skill: str, inputs: Mapping[str, Any]) -> GoalView:
        """Start a skill, with the latest observation as its cause.

        Raises UnknownNameError or InvalidInputError if the skillset has no such skill or refuses the inputs.
        """
        goal = self.interface.start(skill, inputs, cause=self._cause)
        self._live = [*(other for other in self._live if not other.done), goal]
        return goal

    def cancel(self, goal: GoalView) -> None:
        """Interrupt a goal and hand it to the reaper. Returns at once; no effect on a goal that is over."""
        self.reaper.take(goal, self._cause)

    def cancel_all(self) -> None:
        """Interrupt every goal that this mission has started, also those of leaves that are halted."""
        for goal in self._live:
            self.cancel(goal)

    def note_switch(self, subject: str, before: str, after: str) -> None:
        """Record that the tree switches from one branch to another because of the latest failure.

        A failure without a record, such as a timeout, makes the switch a root: earlier observations did not cause it.
        """
        reason = self.failure.text if self.failure else f"{before} failed"
        cause = self.failure.record if self.failure else None
        self._cause = record = self._write_record(subject, before, after, reason, cause)
        self.switches.append(BranchSwitch(subject, before, after, self.now(), reason, record))
