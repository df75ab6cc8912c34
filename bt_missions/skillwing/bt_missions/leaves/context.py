"""Context that the leaves of one mission share: robot, robot time, and the latest observation.

The context also carries causes. A leaf reports each change that it sees (`observe`). The next goal that the tree
starts or interrupts names the record of that change as its cause. A tree is ticked on one thread, so the latest
observation is what the tree reacts to.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

from skillwing.bt_missions.leaves.interface import GoalView, RobotInterface
from skillwing.bt_missions.leaves.reaper import Reaper
from skillwing.dsl.model import Skillset, UnknownNameError
from skillwing.services.rescue_goal import RescueGoal


class RecordWriter(Protocol):
    """Writes one mission record to the timeline and returns its id."""

    def __call__(self, subject: str, before: str | None, after: str, text: str, cause: str | None) -> str: ...


@dataclass(frozen=True, slots=True)
class LeafFailure:
    """Reason of a leaf's failure: a sentence, the timeline record of the change behind it, and the robot."""

    text: str
    record: str | None
    robot: str = ""


@dataclass(frozen=True, slots=True)
class BranchSwitch:
    """A switch of the tree from one branch of `subject` to another, at robot time `t`. record: its timeline record, in
    the timeline of `robot`."""

    subject: str
    before: str
    after: str
    t: float
    reason: str
    record: str
    robot: str = ""


@dataclass(slots=True)
class MissionNotes:
    """Notes of one mission about all of its robots: its branch switches, and the latest failure and observation."""

    switches: list[BranchSwitch] = field(default_factory=list[BranchSwitch])
    failure: LeafFailure | None = None
    observation: str = ""


class MissionContext:
    """Shared by all leaves of one mission, or in a mission on several robots by those of one robot.

    now: robot time in seconds. rescue_goal: of the robot, if it has one. robot: its name in a mission on several robots
    (`robot_group.py`), otherwise empty. notes: of that mission.
    """

    def __init__(
        self,
        interface: RobotInterface,
        skillset: Skillset,
        now: Callable[[], float],
        write_record: RecordWriter,
        rescue_goal: RescueGoal | None = None,
        *,
        robot: str = "",
        notes: MissionNotes | None = None,
    ) -> None:
        self.interface = interface
        self.skillset = skillset
        self.now = now
        self.rescue_goal = rescue_goal
        self.robot = robot
        self.absence = ""
        """Clause with the reason why this robot cannot be reached; empty for one that is there."""
        self.reaper = Reaper(interface, skillset)
        self._notes = notes or MissionNotes()
        self._write_record = write_record
        self._cause: str | None = None
        self._live: list[GoalView] = []

    @property
    def robots(self) -> Mapping[str, MissionContext]:
        """Contexts of the robots of this mission, by name; the only robot has an empty name."""
        return {self.robot: self}

    def of(self, robot: str | None) -> MissionContext:
        """The context of a robot; None for the robot of this context. Raises UnknownNameError."""
        if robot in (None, self.robot):
            return self
        raise UnknownNameError("robot of this mission", robot or "", self.robots)

    @property
    def unfinished(self) -> tuple[GoalView, ...]:
        """Cancelled goals of this mission that have not ended, or still hold a resource."""
        return self.reaper.unfinished

    @property
    def switches(self) -> list[BranchSwitch]:
        return self._notes.switches

    @property
    def failure(self) -> LeafFailure | None:
        """Latest failure of a leaf of this mission."""
        return self._notes.failure

    @failure.setter
    def failure(self, failure: LeafFailure | None) -> None:
        self._notes.failure = failure

    @property
    def last_observation(self) -> str:
        return self._notes.observation

    def observe(self, text: str, record: str | None, *, failed: bool = False) -> None:
        """Note a change that a leaf has seen. failed: the change made the leaf fail."""
        self._cause = record or self._cause
        self._notes.observation = f"{self.robot}: {text}" if self.robot else text
        if failed:
            self._notes.failure = LeafFailure(self._notes.observation, record, self.robot)

    def follow(self, record: str) -> None:
        """Make a record the cause of what the leaves of this robot do next."""
        self._cause = record

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
        self.switches.append(BranchSwitch(subject, before, after, self.now(), reason, record, self.robot))
