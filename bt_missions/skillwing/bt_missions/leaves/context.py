"""What the leaves of one mission share: the way to the robot, robot time, and what happened last.

The context also carries the thread of causes. A leaf that finds something out tells the context (`learn`), and
whatever the tree starts or interrupts next names the record of that event as its cause. A tree is ticked on one
thread, so "what was learnt last" is what the tree is reacting to.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from skillwing.bt_missions.leaves.interface import GoalView, RobotInterface
from skillwing.bt_missions.leaves.reaper import Reaper
from skillwing.dsl.model import Skillset

SETTLE_TIME = 0.2
"""Robot seconds in which news of one event may come in from different processes, in any order. A guard that knows
better than to go on has then had its say."""


class RecordWriter(Protocol):
    """Writes one mission record to the timeline and returns its id."""

    def __call__(self, subject: str, before: str | None, after: str, text: str, cause: str | None) -> str: ...


@dataclass(frozen=True, slots=True)
class LeafFailure:
    """What made a leaf fail: a sentence, and the timeline record of the change behind it."""

    text: str
    record: str | None


@dataclass(frozen=True, slots=True)
class BranchSwitch:
    """At robot time `t` the tree went over from one branch of `subject` to another, and why."""

    subject: str
    before: str
    after: str
    t: float
    reason: str


class MissionContext:
    """Shared by all leaves of one mission. now: robot time in seconds."""

    def __init__(
        self, interface: RobotInterface, skillset: Skillset, now: Callable[[], float], write_record: RecordWriter
    ) -> None:
        self.interface = interface
        self.skillset = skillset
        self.now = now
        self.reaper = Reaper(interface, skillset)
        self.switches: list[BranchSwitch] = []
        self.failure: LeafFailure | None = None
        self.last_observation = ""
        self._write_record = write_record
        self._cause: str | None = None
        self._live: list[GoalView] = []

    def observe(self, text: str, record: str | None, *, failed: bool = False) -> None:
        """Take note of a change that a leaf has seen. failed: it made the leaf fail."""
        self._cause = record or self._cause
        self.last_observation = text
        if failed:
            self.failure = LeafFailure(text, record)

    def start(self, skill: str, inputs: Mapping[str, Any]) -> GoalView:
        """Start a skill because of what was learnt last.

        Raises UnknownNameError or InvalidInputError for what the skillset does not know.
        """
        goal = self.interface.start(skill, inputs, cause=self._cause)
        self._live = [*(other for other in self._live if not other.done), goal]
        return goal

    def cancel(self, goal: GoalView) -> None:
        """Interrupt a goal and leave it to the reaper. Returns at once; harmless for a goal that is over."""
        self.reaper.take(goal, self._cause)

    def cancel_all(self) -> None:
        """Interrupt every goal that this mission has started, whatever became of its leaf."""
        for goal in self._live:
            self.cancel(goal)

    def note_switch(self, subject: str, before: str, after: str) -> None:
        """Record that the tree goes over from one branch to another because of the latest failure."""
        reason = self.failure.text if self.failure else f"{before} failed"
        self.switches.append(BranchSwitch(subject, before, after, self.now(), reason))
        cause = self.failure.record if self.failure else None
        self._cause = self._write_record(subject, before, after, reason, cause or self._cause)
