"""Whether a flight stands still, and who or what made it."""

from __future__ import annotations

from typing import NamedTuple

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from skillwing.bt_missions.leaves.skills import Interface
from skillwing.bt_missions.running.phase import Phase
from skillwing.bt_missions.subtrees.holding import Pausable, WhileGranted


class Standing(NamedTuple):
    """RUNNING, PAUSED or HELD; why; and the record of what made it so, if the robot did."""

    phase: Phase
    reason: str = ""
    cause: str | None = None


class Holders:
    """The nodes of a tree that may hold its flight. Its shape must not change."""

    def __init__(self, tree: Behaviour, interface: Interface) -> None:
        nodes = list(tree.iterate())
        self._grants = [node for node in nodes if isinstance(node, WhileGranted)]
        self._pausables = [node for node in nodes if isinstance(node, Pausable)]
        self._interface = interface

    @property
    def pausable(self) -> Pausable | None:
        """What can be paused at this moment."""
        return next((node for node in self._pausables if node.status is Status.RUNNING), None)

    @property
    def standing(self) -> Standing:
        """How a mission that is neither waiting nor over is just now. The pilot comes before the operator."""
        for grant in self._grants:
            if grant.status is Status.RUNNING and grant.reason is not None:
                cause = self._interface.change_record(grant.resource)
                return Standing(Phase.HELD, grant.feedback_message, cause)
        if self.pausable is not None and self.pausable.reason is not None:
            return Standing(Phase.PAUSED, self.pausable.reason)
        return Standing(Phase.RUNNING)
