"""Whether a flight stands still, and who or what made it."""

from __future__ import annotations

from typing import NamedTuple

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from skillwing.bt_missions.leaves.skills import Interface
from skillwing.bt_missions.subtrees.holding import Pausable, WhileGranted
from skillwing.services.protocol import MissionPhase


class Standing(NamedTuple):
    """RUNNING, PAUSED or HELD; why; and the record of what made it so, if the robot did."""

    phase: MissionPhase
    reason: str = ""
    cause: str | None = None


class Holders:
    """The nodes of a tree that may hold its flight. Its shape must not change."""

    def __init__(self, tree: Behaviour, interface: Interface) -> None:
        nodes = list(tree.iterate())
        self._grants = [node for node in nodes if isinstance(node, WhileGranted)]
        self._pausables = [node for node in nodes if isinstance(node, Pausable)]
        self._interface = interface

    def pause(self, reason: str) -> str | None:
        """Pause what can be paused at this moment. Returns a sentence that says what is against it."""
        pausable = self._pausable
        if pausable is None:
            return "This part of the mission cannot be paused; it can be aborted."
        against = pausable.pause(reason)
        return None if against is None else f"The mission is not paused: {against}."

    def resume(self) -> str | None:
        """Let it go on. Returns a sentence that says what is against it."""
        pausable = self._pausable
        if pausable is None or pausable.reason is None:
            return "The mission is not paused."
        pausable.resume()
        return None

    @property
    def _pausable(self) -> Pausable | None:
        return next((node for node in self._pausables if node.status is Status.RUNNING), None)

    @property
    def standing(self) -> Standing:
        """How a mission that is neither waiting nor over is just now. The pilot comes before the operator."""
        for grant in self._grants:
            if grant.status is Status.RUNNING and grant.reason is not None:
                cause = self._interface.change_record(grant.resource)
                return Standing(MissionPhase.HELD, grant.feedback_message, cause)
        if self._pausable is not None and self._pausable.reason is not None:
            return Standing(MissionPhase.PAUSED, self._pausable.reason)
        return Standing(MissionPhase.RUNNING)
