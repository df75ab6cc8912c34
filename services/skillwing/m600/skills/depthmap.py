"""Base of the managers of the two skills that produce the depth map."""

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
"""Largest age of a measurement in a depth map [s]."""
NO_DATA = f"no measurement for {PATIENCE:g} s"
"""Phrase for the reason of an end without a fresh depth map."""


class DepthmapManager(SkillHooks[I, O, F]):
    """Depth map from `source`, made by the obstacle node until the skill ends."""

    source: ClassVar[ObstacleSource]

    def setup(self) -> None:
        self._switch = Switch(self, OBSTACLE_COMMAND, self._select, node="obstacle node")
        self._status = Latest(self.bus, OBSTACLE_STATUS, ObstacleStatus, self._on_status, at_rest=True)
        self._watchdog: Handle | None = None
        self._measured_at = 0.0

    @property
    def obstacle_distance(self) -> float | None:
        """Free metres on the way, or to the nearest obstacle ahead; None if the depth map shows none."""
        status = self._status.value
        if status is None or status.source is not self.source:
            return None
        return status.free_distance if status.free_distance is not None else status.ahead

    @abstractmethod
    def no_data(self, goal: Goal[I]) -> None:
        """End the goal: there is no fresh depth map."""

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
