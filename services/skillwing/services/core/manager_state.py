"""State of a resource manager: what its rules read and change."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import TypeAlias

from skillwing.dsl.expressions import Environment
from skillwing.dsl.model import Skill, Skillset, UnknownNameError
from skillwing.services.core.checks import unknown_name
from skillwing.services.core.incarnations import Incarnations
from skillwing.services.core.latest_data import LatestData
from skillwing.services.core.ledger import Ledger
from skillwing.services.core.outbox import RecordOutbox
from skillwing.services.core.resource_table import ResourceTable
from skillwing.services.core.snapshot import Entry
from skillwing.services.protocol import Lost, Record, RecordKind, ResourceStates, Violated

Publication: TypeAlias = Violated | Lost | Record
"""Messages that a step publishes."""
NO_INPUTS: Mapping[str, object] = MappingProxyType({})
"""Inputs of guards that belong to no goal."""


@dataclass(slots=True)
class ManagerState:
    """Parts of a resource manager's memory, and the changes of the present step.

    source: name of the process, for the timeline. outbox: publications of the step; entries: what the journal has to
    store of it. last_step: number of the last step that told anything; epoch: name of the series of these numbers.
    """

    source: str
    skillset: Skillset
    table: ResourceTable
    ledger: Ledger
    incarnations: Incarnations
    data: LatestData
    outbox: RecordOutbox[Publication]
    entries: list[Entry]
    last_step: int
    epoch: str

    @property
    def step(self) -> int:
        """Number of the present step, or of the one before as long as this one has told nothing."""
        return self.last_step if self.outbox.empty else self.last_step + 1

    def resource_states(self, now: float) -> ResourceStates:
        """All states as a message."""
        return ResourceStates(step=self.step, epoch=self.epoch, states=dict(self.table.states), t=now)

    def environment(self, now: float, inputs: Mapping[str, object] = NO_INPUTS) -> Environment:
        """Values for guards: states, fresh data and a goal's inputs."""
        return Environment(resources=self.table.states, data=self.data.fresh(now), inputs=inputs)

    def skill(self, name: str) -> Skill:
        """The skill of that name; refuses an unknown one."""
        try:
            return self.skillset.skill(name)
        except UnknownNameError as error:
            raise unknown_name(error) from error

    def apply_effect(self, skill: Skill, effect: str | None, cause: str, goal_id: str, now: float) -> str:
        """Apply an effect of a skill as a whole, or not at all: then return a sentence why, otherwise ""."""
        transitions = skill.transitions(effect)
        obstacle = self.table.obstacle(transitions)
        if obstacle is not None:
            return f"The effect `{effect}` could not be applied: {obstacle}"
        self.table.apply(transitions, now, f"effect {effect} of {skill.name}", cause=cause, goal_id=goal_id)
        return ""

    def record_goal(self, skill: Skill, after: str, now: float, goal_id: str, cause: str | None, text: str) -> str:
        """Add a timeline record about a goal; returns its id."""
        return self.outbox.record(now, RecordKind.GOAL, skill.name, None, after, text, cause=cause, goal_id=goal_id)
