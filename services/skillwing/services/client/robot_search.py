"""Search of a node for other robots at its router: each describes itself, and nothing waits."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from typing import Protocol, runtime_checkable

import msgspec

from skillwing.dsl import SkillsetError, parse
from skillwing.dsl.model import Skillset
from skillwing.services.bus import Answered, Bus, MultiRobotBus, Refused
from skillwing.services.client.retry import ask_until_answered
from skillwing.services.names import MISSION, RESOURCE_MANAGER
from skillwing.services.protocol import Keys, ProtocolError, QueryRobot, RobotDescription, decode, encode
from skillwing.services.rescue_goal import RescueGoal

TIMEOUT = 10.0
"""Seconds of wall time until a robot counts as missing."""

SAME_VERSION = "Run the same version of Skillwing on all robots."


@runtime_checkable
class SearchBus(Bus, MultiRobotBus, Protocol):
    """A bus by which other robots are found."""


@dataclass(frozen=True, slots=True)
class FoundRobot:
    """A robot as it describes itself. follows_time: one of its processes owns its time. mission_runs: it has a mission
    already. shared: several missions may use it at once."""

    skillset: Skillset
    follows_time: bool
    rescue_goal: RescueGoal | None
    mission_runs: bool
    shared: bool


class RobotSearch:
    """Search for robots by name. It calls `on_end` once, with all that were found within `TIMEOUT`.

    objections: reason and remedy for each robot that answered and did not describe itself, as one of another version.
    """

    def __init__(self, bus: SearchBus, robots: Iterable[str], on_end: Callable[[dict[str, FoundRobot]], None]) -> None:
        self._bus = bus
        self._on_end = on_end
        self.objections: dict[str, str] = {}
        self._found: dict[str, FoundRobot] = {}
        self._missions: set[str] = set()
        self._asked: set[str] = set()
        self._views = {robot: bus.beside(robot) for robot in dict.fromkeys(robots)}
        self._deadline = bus.after(TIMEOUT, self._end, wall=True)
        self._watches = [
            watch
            for robot, view in self._views.items()
            for watch in (
                view.watch_alive(Keys("*").alive(MISSION), partial(self._note_mission, robot)),
                view.watch_alive(Keys("*").alive(RESOURCE_MANAGER), partial(self._ask, robot)),
            )
        ]

    def cancel(self) -> None:
        """Leave the other robots. Idempotent."""
        self._deadline.cancel()
        for watch in self._watches:
            watch.cancel()
        self._watches = []
        for view in self._views.values():
            if view is not self._bus:
                view.close()
        self._views = {}

    def _note_mission(self, robot: str, key: str, alive: bool) -> None:
        del key
        (self._missions.add if alive else self._missions.discard)(robot)

    def _ask(self, robot: str, key: str, alive: bool) -> None:
        if not alive or robot in self._asked:
            return
        self._asked.add(robot)
        question = Keys(key.partition("/")[0]).resource_robot
        ask_until_answered(
            *(self._views[robot], question, encode(QueryRobot()), partial(self._take, robot)),
            keep_retrying=lambda silences: bool(self._views),
        )

    def _take(self, robot: str, answer: Answered | Refused) -> None:
        if not self._views:
            return
        if isinstance(answer, Refused):
            self.objections[robot] = f"{answer.error.message} {answer.error.help or SAME_VERSION}"
            return
        try:
            self._found[robot] = self._described(robot, answer.payload)
        except (ProtocolError, SkillsetError, msgspec.ValidationError) as error:
            self.objections[robot] = (
                f"Its description is not understood: {str(error).removesuffix('.')}. {SAME_VERSION}"
            )
            return
        if len(self._found) == len(self._views):
            self._end()

    def _described(self, robot: str, description: bytes) -> FoundRobot:
        told = decode(description, RobotDescription)
        return FoundRobot(
            parse(told.source, f"{robot}.skillset"),
            told.clock == "robot",
            msgspec.convert(told.rescue_goal, RescueGoal | None),
            robot in self._missions,
            told.shared,
        )

    def _end(self) -> None:
        self.cancel()
        self._on_end(self._found)
