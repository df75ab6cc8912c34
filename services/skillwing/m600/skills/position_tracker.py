"""The drone's position, for the manager of a skill that flies."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from skillwing.m600.latest import Latest
from skillwing.onboard.topics.common import Vector3
from skillwing.onboard.topics.navigation import NAVIGATION, Navigation
from skillwing.services.bus import Handle
from skillwing.services.managers.skill_manager import Goal, SkillHooks

PATIENCE = 2.0
"""Longest wait for a first position before the goal fails [s]."""


class PositionTracker:
    """Subscriber to navigation while a goal flies: 50 solutions a second are too many for a manager that waits."""

    def __init__(self, hooks: SkillHooks[Any, Any, Any]) -> None:
        self._hooks = hooks
        self._navigation = Latest(hooks.bus, NAVIGATION, Navigation, self._receive, at_rest=True)
        self._on_known: Callable[[Vector3], None] | None = None
        self._watchdog: Handle | None = None

    @property
    def position(self) -> Vector3 | None:
        """ENU [m]; None before the goal's first navigation solution."""
        return None if self._navigation.value is None else self._navigation.value.position

    def follow(self) -> None:
        """Follow navigation until `rest`."""
        self._navigation.follow()

    def locate(self, goal: Goal[Any], on_known: Callable[[Vector3], None]) -> None:
        """Follow navigation, and call `on_known` once with the first position; without any the goal fails."""
        self._on_known = on_known
        self._watchdog = self._hooks.bus.after(PATIENCE, lambda: self._give_up(goal))
        self._navigation.follow()

    def rest(self) -> None:
        """Unsubscribe at the end of a goal. Idempotent."""
        self._navigation.rest()
        self._on_known = None
        if self._watchdog is not None:
            self._watchdog.cancel()

    def _receive(self, navigation: Navigation) -> None:
        on_known, self._on_known = self._on_known, None
        if on_known is not None:
            on_known(navigation.position)

    def _give_up(self, goal: Goal[Any]) -> None:
        if self._on_known is not None:
            sentence = "There is no navigation solution. Wait until the drone knows where it is."
            self._hooks.failed(goal.id, sentence)
