"""Nodes of the stand: a skill that stays in each state as commanded, and the mission that starts it."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import msgspec

from skillwing.dsl import load
from skillwing.services.bus import Bus, Node, Sample
from skillwing.services.client.interface import SkillsetInterface
from skillwing.services.managers.hooks import Goal, SkillHooks
from skillwing.services.protocol import StartGoal, decode

STAND = Path(__file__).with_name("stand.skillset")
SKILL = "work"
MISSION = "mission"
ORDERS = "chaos/orders"
"""Key of the goals that the mission is to start."""


class Stages(msgspec.Struct, frozen=True, kw_only=True):
    """Wall seconds that a goal of `work` spends in each state."""

    validate: float = 0.0
    dispatch: float = 0.0
    run: float = 0.05
    stop: float = 0.0


class WorkManager(SkillHooks[Stages, None, None]):
    """Hooks of `work`, which block in `validate` and `on_dispatch` to keep a goal VALIDATING or DISPATCHING."""

    skill = SKILL
    Inputs = Stages

    def validate(self, goal: Goal[Stages]) -> None:
        time.sleep(goal.inputs.validate)

    def on_dispatch(self, goal: Goal[Stages]) -> None:
        time.sleep(goal.inputs.dispatch)
        self.bus.after(goal.inputs.run, lambda: self.terminated(goal.id, "DONE"), wall=True)

    def on_interrupt(self, goal: Goal[Stages]) -> None:
        self.bus.after(goal.inputs.stop, lambda: self.interrupted(goal.id), wall=True)


class Mission:
    """Mission that starts and owns the goals in its orders."""

    name = MISSION
    owns_clock = False

    def attach(self, bus: Bus) -> None:
        self._interface = SkillsetInterface(bus, load(STAND), client=MISSION, owns_goals=True)
        bus.subscribe(ORDERS, self._on_order)

    def detach(self) -> None:
        """Do nothing: the alive token ends with the bus."""

    def _on_order(self, sample: Sample) -> None:
        order = decode(sample.payload, StartGoal)
        self._interface.start(SKILL, order.inputs, goal_id=order.goal_id)


def make_mission(options: dict[str, Any]) -> Node:
    """A mission, which has no options."""
    del options
    return Mission()
