"""What the two skills that produce the depth map have in common."""

from __future__ import annotations

from abc import abstractmethod
from typing import ClassVar

from skillwing.m600.latest import Latest
from skillwing.m600.skills.switch import Switch
from skillwing.onboard.topics.obstacles import (
    OBSTACLE_COMMAND,
    OBSTACLE_STATUS,
    ObstacleSource,
    ObstacleStatus,
    SelectObstacleSource,
)
from skillwing.services.bus import Handle
from skillwing.services.managers.hooks import F, I, O
from skillwing.services.managers.skill_manager import Goal, SkillHooks
from skillwing.services.protocol import Terminal

PATIENCE = 2.0
"""Without a measurement younger than this there is no depth map [s]."""


class DepthmapManager(SkillHooks[I, O, F]):
    """Has the obstacle node make its depth map from `source` until the skill ends."""

    source: ClassVar[ObstacleSource]

    def setup(self) -> None:
        self._switch = Switch(self, OBSTACLE_COMMAND, self._select, node="obstacle node")
        self._status = Latest(self.bus, OBSTACLE_STATUS, ObstacleStatus, self._on_status, at_rest=True)
        self._watchdog: Handle | None = None
        self._measured_at = 0.0

    @property
    def obstacle_distance(self) -> float | None:
        """Metres that are free on the way, or to the nearest obstacle ahead; None where the depth map shows none."""
        status = self._status.value
        if status is None or status.source is not self.source:
            return None
        return status.free_distance if status.free_distance is not None else status.ahead

    @abstractmethod
    def no_data(self, goal: Goal[I]) -> None:
        """There is no fresh depth map, from the start or any more."""

    def on_dispatch(self, goal: Goal[I]) -> None:
        self._measured_at = self.bus.now()
        self._status.follow()
        self._watchdog = self.bus.every(PATIENCE / 4, lambda: self._watch(goal))
        self._switch.on(goal)

    def on_interrupt(self, goal: Goal[I]) -> None:
        self._switch.off(goal)

    def on_ended(self, goal: Goal[I], terminal: Terminal) -> None:
        if self._watchdog is not None:
            self._watchdog.cancel()
        self._status.rest()
        self._switch.release(goal)

    def _select(self, goal: Goal[I], on: bool) -> SelectObstacleSource:
        source = self.source if on else ObstacleSource.NONE
        return SelectObstacleSource(goal_id=goal.id, token=goal.token, source=source)

    def _on_status(self, status: ObstacleStatus) -> None:
        if status.source is self.source and status.stamp is not None:
            self._measured_at = max(self._measured_at, status.stamp)

    def _watch(self, goal: Goal[I]) -> None:
        if self.bus.now() - self._measured_at >= PATIENCE:
            self.no_data(goal)
