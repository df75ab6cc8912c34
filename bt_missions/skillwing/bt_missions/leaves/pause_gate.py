"""Gates that hold skills for a while without halting the tree above them."""

from __future__ import annotations

from typing import Protocol

from skillwing.services.protocol import Terminal

HELD = "HELD"
"""Ending of a leaf that was held and does not start again, as a key of `SkillAction.outcomes`."""


class PauseGate(Protocol):
    """A node above a leaf that may hold it: a person has the robot, or the operator has paused the mission."""

    def blocks(self, skill: str) -> str | None:
        """Reason why `skill` must not run now; None if it may run."""
        ...

    def explains(self, skill: str, terminal: Terminal) -> bool:
        """True if a goal of `skill` ended so because of this gate, which may not have seen the change yet."""
        ...


class PauseGates:
    """All gates above one leaf, which runs `skill`."""

    def __init__(self, skill: str) -> None:
        self._skill = skill
        self._gates: list[PauseGate] = []

    def add(self, gate: PauseGate) -> None:
        self._gates.append(gate)

    def blocked_by(self) -> str | None:
        """Reason of the first gate that blocks the skill now."""
        return next((reason for gate in self._gates if (reason := gate.blocks(self._skill)) is not None), None)

    def explain(self, terminal: Terminal) -> bool:
        return any(gate.explains(self._skill, terminal) for gate in self._gates)
