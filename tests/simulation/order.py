"""Promises on what clients see: states of one step, and no goal before the states that it follows from."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeAlias

from simulation.world import Client
from skillwing.services.client.causal_feed import NO_ANSWER, STILL_HELD
from skillwing.services.client.goal_handle import GoalHandle
from skillwing.services.core.resource_core import ResourceCore
from skillwing.services.protocol import Ending, GoalStatus, Record, ResourceStates, ResourceStep

LAW = "causes before effects"

StepId: TypeAlias = tuple[str, int]
"""Epoch and number of a step."""


@dataclass
class HeldSpan:
    """Steps of an epoch between which a goal held its resources: from `begin`, at time `t` [s], to before `end`."""

    t: float
    epoch: str
    begin: int
    end: int | None = None


class CausalOrder:
    """Steps of the resource manager, and what has to be known with each. Each method returns broken promises."""

    def __init__(self) -> None:
        self._steps: dict[str, int] = {}
        """Number of the step that a record belongs to, or that the status of that record follows from."""
        self._causes: dict[str, str] = {}
        """Cause of each record."""
        self._states: dict[StepId, dict[str, str]] = {}
        self._changes: dict[str, Record] = {}
        self._holds: dict[str, HeldSpan] = {}
        """The latest one of each goal."""
        self._asked: dict[tuple[str, str], float] = {}
        """Times of the questions whether a goal has released its resources, by client and goal."""

    def expect_new_books(self) -> None:
        """A resource manager without a journal was killed: nothing follows from its steps any more."""
        self._steps.clear()
        self._holds.clear()

    # --- at the source -----------------------------------------------------------------------------------------------

    def note_step(self, step: ResourceStep, states: dict[str, str]) -> None:
        """Note a step, and the states after it."""
        self._states[step.epoch, step.number] = dict(states)
        self._steps |= dict.fromkeys((record.id for record in step.records), step.number)
        self._changes |= {change.id: change for change in step.changes}

    def note_states(self, told: ResourceStates) -> None:
        """Note the states of a reply."""
        self._states.setdefault((told.epoch, told.step), told.states)

    def note_record(self, record: Record) -> None:
        if record.cause is not None:
            self._causes[record.id] = record.cause

    def note_grants(self, t: float, core: ResourceCore) -> None:
        """Note which goals hold a grant after the latest step."""
        held = {grant.goal_id for grant in core.grants}
        for goal, hold in self._holds.items():
            if hold.end is None and goal not in held:
                hold.end = core.last_step
        for goal in held - self._holds.keys():
            self._holds[goal] = HeldSpan(t, core.epoch, core.last_step)

    def note_search(self, t: float, client: Client) -> None:
        """A client asks about the goals that it has found lost. One that is granted only then is interrupted later."""
        for goal, tracker in client.interface._trackers.items():
            if tracker._lost:
                self._asked.setdefault((client.name, goal), t)

    def judge_status(self, status: GoalStatus) -> str | None:
        """A status names the step that it follows from, so that clients can wait for it."""
        follows = self._steps.get(status.cause or "", 0)
        if status.record is not None:
            self._steps[status.record] = status.after_step
        if status.after_step >= follows:
            return None
        return f"{status.goal_id} is {status.label} by step {follows}, and names step {status.after_step}"

    # --- at a client -------------------------------------------------------------------------------------------------

    def judge_goal(self, client: Client, goal: GoalHandle) -> str | None:
        """No client sees a goal before the step that it follows from, or a loss while the goal holds its resources."""
        step = client.interface.step
        if step is None or client.interface.resource_manager_silent:
            return None
        follows = self._follows(goal.record or "")
        if follows > step:
            return f"{client.name} sees {goal} of step {follows}, and the states of step {step}"
        if _is_found_lost(goal) and self._holds_at(client, goal.goal_id, step):
            return f"{client.name} sees {goal}, and the states of step {step}, in which it holds its resources"
        return None

    def _holds_at(self, client: Client, goal_id: str, step: int) -> bool:
        """True if a goal held its resources at a step, and when the client asked."""
        hold = self._holds.get(goal_id)
        if hold is None or hold.epoch != _epoch(client) or hold.t > self._asked.get((client.name, goal_id), math.inf):
            return False
        return hold.begin <= step and (hold.end is None or step < hold.end)

    def judge_states(self, client: Client) -> str | None:
        """The states that a client sees are those of one step, and the causes of their changes are true."""
        interface = client.interface
        if interface.step is None or interface.resource_manager_silent:
            return None
        states, true = dict(interface.states), self._states.get((_epoch(client), interface.step))
        if states != true:
            return f"{client.name} sees {states} as the states of step {interface.step}, which are {true}"
        for resource, state in states.items():
            record = interface.change_record(resource)
            change = None if record is None else self._changes[record]
            if change is not None and (change.subject, change.after) != (resource, state):
                return f"{client.name} sees {resource} {state}, by the change {change.id} to {change.after}"
        return None

    def _follows(self, record: str) -> int:
        """Number of the step that a record follows from. A client's own record follows from its cause."""
        return self._steps.get(record, self._steps.get(self._causes.get(record, ""), 0))


def _is_found_lost(goal: GoalHandle) -> bool:
    """True for a loss that the client has found by itself, unless it says that the states before it are shown."""
    terminal = goal.terminal
    if terminal is None or terminal.ending is not Ending.LOST or terminal.detected_by != "client":
        return False
    return not terminal.reason.endswith((NO_ANSWER, STILL_HELD))


def _epoch(client: Client) -> str:
    return client.interface._resources._epoch
