"""Context of a mission on several robots: a context for each robot, with its goals, states and data apart.

A leaf about a robot takes the context of that robot: `robot="left"` of the leaf, or `context.of("left")` for all leaves
of a subtree. Leaves about the mission, such as a switch between branches, take the context of the group.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NoReturn

from skillwing.bt_missions.leaves.context import BranchSwitch, LeafFailure, MissionContext, MissionNotes
from skillwing.bt_missions.leaves.interface import GoalView
from skillwing.dsl.model import UnknownNameError
from skillwing.dsl.suggest import listed


class MissingRobotError(Exception):
    """A node that has to name one of several robots and names none. `str()` is a sentence."""

    def __init__(self, robots: Mapping[str, MissionContext]) -> None:
        super().__init__(f"It names none of the robots {listed(robots)}; add `robot`.")


STOPPED = 1.0
"""Seconds by which a clock may be behind the others. One that is further behind had stopped, and joins them again."""


class GroupTime:
    """Time of a mission on several robots, in seconds: it passes as long as that of any robot passes.

    clocks: robot time of each. Their zeros differ, and one stands still when its robot is gone. Each comes by messages
    of its own, so one may be behind another for a moment. The same second is counted once.
    """

    def __init__(self, clocks: Mapping[str, Callable[[], float]]) -> None:
        self._clocks = dict(clocks)
        self._last = {robot: clock() for robot, clock in self._clocks.items()}
        self._zeros = dict(self._last)
        """Robot time of each robot at which the time of the group is 0."""
        self._now = 0.0

    def __call__(self) -> float:
        latest = self._now
        for robot, clock in self._clocks.items():
            t, before = clock(), self._last[robot]
            is_late = self._now - (before - self._zeros[robot]) > STOPPED
            if t < before or (t > before and is_late):  # its system was started again, or it had stopped
                self._zeros[robot] = t - self._now
            self._last[robot] = t
            latest = max(latest, t - self._zeros[robot])
        self._now = latest
        return self._now


class RobotGroup(MissionContext):
    """Context of the robots of a mission, each with the same notes. write_records: writes a mission record to the
    timelines of all robots, with the cause of one of them, and returns its id in each."""

    def __init__(
        self,
        robots: Mapping[str, MissionContext],
        notes: MissionNotes,
        write_records: Callable[[str, str | None, str, str, Mapping[str, str | None]], Mapping[str, str]],
    ) -> None:
        self._robots = dict(robots)
        self._notes = notes
        self._write_records = write_records
        self.now = GroupTime({name: context.now for name, context in self._robots.items()})
        self.robot = ""
        self.absence = ""

    def __getattr__(self, name: str) -> NoReturn:
        """Refuse `interface`, `skillset` and others, which only the robots have."""
        if name in ("interface", "skillset", "rescue_goal", "reaper"):
            raise MissingRobotError(self._robots)
        raise AttributeError(name)

    @property
    def robots(self) -> Mapping[str, MissionContext]:
        return self._robots

    def of(self, robot: str | None) -> MissionContext:
        """The context of a robot. Raises MissingRobotError for None, and UnknownNameError."""
        if not robot:
            raise MissingRobotError(self._robots)
        if robot not in self._robots:
            raise UnknownNameError("robot of this mission", robot, self._robots)
        return self._robots[robot]

    @property
    def unfinished(self) -> tuple[GoalView, ...]:
        return tuple(goal for context in self._robots.values() for goal in context.unfinished)

    def observe(self, text: str, record: str | None, *, failed: bool = False) -> None:
        """Note a change that concerns the mission as a whole; no robot has a record of it."""
        self._notes.observation = text
        if failed:
            self._notes.failure = LeafFailure(text, record)

    def start(self, skill: str, inputs: Mapping[str, object]) -> NoReturn:
        raise MissingRobotError(self._robots)

    def cancel(self, goal: GoalView) -> NoReturn:
        raise MissingRobotError(self._robots)

    def cancel_all(self) -> None:
        for context in self._robots.values():
            context.cancel_all()

    def note_switch(self, subject: str, before: str, after: str) -> None:
        failure = self.failure
        reason = failure.text if failure else f"{before} failed"
        causes = {name: failure.record if failure and failure.robot == name else None for name in self._robots}
        records = self._write_records(subject, before, after, reason, causes)
        for name, context in self._robots.items():
            context.follow(records[name])
        robot = failure.robot if failure and failure.robot else next(iter(self._robots))
        self.switches.append(BranchSwitch(subject, before, after, self.now(), reason, records[robot], robot))
