"""Switch for a node of the functional layer that runs for a goal: on at its start, off at its end."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from skillwing.m600.functional_layer_client import SentCommand, send_command
from skillwing.services.managers.skill_manager import Goal, SkillHooks
from skillwing.services.protocol import Message


class Switch:
    """Switch of one node, for the manager of one skill.

    key: the node's key for commands. message: makes the command that switches it on or off for a goal. node: its name
    in sentences. A node that refuses or does not answer fails the goal.
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
        self._command: SentCommand | None = None
        self.on_since: float | None = None
        """Time at which the node accepted to run for the goal; None while it is not asked to."""

    def on(self, goal: Goal[Any]) -> None:
        """Switch the node on for the goal."""
        self._goal = goal
        self.on_since = None
        self._send(goal, on=True, on_accepted=self._is_on)

    def off(self, goal: Goal[Any]) -> None:
        """Switch the node off, and confirm the goal's interruption once it is off."""
        self.on_since = None
        self._send(goal, on=False, on_accepted=lambda: self._confirm(goal))

    def release(self, goal: Goal[Any]) -> None:
        """Switch the node off at the end of the goal."""
        if self._command is not None:
            self._command.cancel()
        if self._goal is not None and self._goal.id == goal.id:
            self._goal, self.on_since = None, None
            send_command(self._hooks.bus, self._key, self._message(goal, False))

    def _is_on(self) -> None:
        self.on_since = self._hooks.bus.now()

    def _confirm(self, goal: Goal[Any]) -> None:
        self._goal = None
        self._hooks.interrupted(goal.id)

    def _send(self, goal: Goal[Any], *, on: bool, on_accepted: Callable[[], None]) -> None:
        if self._command is not None:
            self._command.cancel()
        fail = self._hooks.failed
        self._command = send_command(
            self._hooks.bus,
            self._key,
            self._message(goal, on),
            on_accepted=on_accepted,
            on_refused=lambda sentence: fail(goal.id, f"The {self._node} refused. {sentence}"),
            on_silence=lambda: fail(goal.id, f"The {self._node} does not answer. Check that its process runs."),
        )
