"""Pause state of a mission: running, paused by the operator, or held while a person has the robot."""

from __future__ import annotations

from typing import NamedTuple

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from skillwing.bt_missions.leaves.context import MissionContext
from skillwing.bt_missions.subtrees.pausing import Pausable, WhileGranted
from skillwing.services.protocol import MissionPhase


class PauseState(NamedTuple):
    """RUNNING, PAUSED or HELD, the reason, and the record of a robot's change that caused it, if any."""

    phase: MissionPhase
    reason: str = ""
    cause: str | None = None
    robot: str = ""


class PauseControl:
    """Pauses and resumes the nodes of a tree that can hold it. The shape of the tree must not change."""

    def __init__(self, tree: Behaviour, context: MissionContext) -> None:
        nodes = list(tree.iterate())
        self._grants = [node for node in nodes if isinstance(node, WhileGranted)]
        self._pausables = [node for node in nodes if isinstance(node, Pausable)]
        self._context = context

    def pause(self, reason: str) -> str | None:
        """Pause the part that can be paused now. Returns a sentence if that is not possible."""
        pausable = self._pausable
        if pausable is None:
            return "This part of the mission cannot be paused; it can be aborted."
        refusal = pausable.pause(reason)
        return None if refusal is None else f"The mission is not paused: {refusal}."

    def resume(self) -> str | None:
        """Continue. Returns a sentence if that is not possible."""
        pausable = self._pausable
        if pausable is None or pausable.reason is None:
            return "The mission is not paused."
        pausable.resume()
        return None

    @property
    def _pausable(self) -> Pausable | None:
        return next((node for node in self._pausables if node.status is Status.RUNNING), None)

    @property
    def state(self) -> PauseState:
        """State of a mission that has begun and is not over. HELD comes before PAUSED."""
        for grant in self._grants:
            if grant.status is Status.RUNNING and grant.reason is not None:
                cause = self._context.robots[grant.robot].interface.change_record(grant.resource)
                return PauseState(MissionPhase.HELD, grant.feedback_message, cause, grant.robot)
        if self._pausable is not None and self._pausable.reason is not None:
            return PauseState(MissionPhase.PAUSED, self._pausable.reason)
        return PauseState(MissionPhase.RUNNING)
