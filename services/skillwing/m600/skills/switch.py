"""How a skill manager runs a part of the functional layer that is switched on for a goal and off at its end."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from skillwing.m600.functional_layer_client import Command
from skillwing.services.managers.skill_manager import Goal, SkillHooks
from skillwing.services.protocol import Message


class Switch:
    """The switch of one node, as the manager of one skill sees it.

    key: where the node takes commands. message: the command that switches it on or off for a goal. node: what it is
    called in sentences. A node that refuses or does not answer fails the goal.
    """

    def __init__(
        self,
        hooks: SkillHooks[Any, Any, Any],
        key: str,
        message: Callable[[Goal[Any], bool], Message],
        *,
        node: str,
    ) -> None:
        self._hooks, self._key, self._message, self._node = hooks, key, message, node
        self._goal: Goal[Any] | None = None
        self._command: Command | None = None
        self.on_since: float | None = None
        """Since when the node runs for the goal, by its own account; None while it does not have to."""

    def on(self, goal: Goal[Any]) -> None:
        """Switch the node on for the goal."""
        self._goal = goal
        self.on_since = None
        self._send(goal, on=True, on_taken=self._is_on)

    def off(self, goal: Goal[Any]) -> None:
        """Switch the node off, and confirm the goal's interruption once it is."""
        self.on_since = None
        self._send(goal, on=False, on_taken=lambda: self._confirm(goal))

    def release(self, goal: Goal[Any]) -> None:
        """The goal is over: switch off what still runs for it."""
        if self._command is not None:
            self._command.cancel()
        if self._goal is not None and self._goal.id == goal.id:
            self._goal, self.on_since = None, None
            Command(self._hooks.bus, self._key, self._message(goal, False))

    def _is_on(self) -> None:
        self.on_since = self._hooks.bus.now()

    def _confirm(self, goal: Goal[Any]) -> None:
        self._goal = None
        self._hooks.interrupted(goal.id)

    def _send(self, goal: Goal[Any], *, on: bool, on_taken: Callable[[], None]) -> None:
        if self._command is not None:
            self._command.cancel()
        fail = self._hooks.failed
        self._command = Command(
            self._hooks.bus,
            self._key,
            self._message(goal, on),
            on_taken=on_taken,
            on_refused=lambda sentence: fail(goal.id, f"The {self._node} refused. {sentence}"),
            on_silence=lambda: fail(goal.id, f"The {self._node} does not answer. Check that its process runs."),
        )
