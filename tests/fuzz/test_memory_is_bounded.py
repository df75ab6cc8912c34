"""The memory of managers and clients does not grow with the number of goals.

`SOAK_GOALS=100000` makes it a soak: `make fuzz` does.
"""

from __future__ import annotations

import contextlib
import os
from itertools import count

from held_objects import items_held
from skillwing.dsl import parse
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.client.interface import SkillsetInterface
from skillwing.services.core.bounded_dict import GOALS_REMEMBERED
from skillwing.services.core.delivery import PENDING_OUTCOMES_LIMIT, SILENCES_UNTIL_ABANDONED
from skillwing.services.core.refusal import RefusedError
from skillwing.services.core.resource_core import ResourceCore
from skillwing.services.core.skill_actions import AskResources, CallHook, Hook
from skillwing.services.core.skill_core import SkillCore
from skillwing.services.core.skill_events import Dispatched, QuestionAnswered, Terminated, Validated
from skillwing.services.managers.data_manager import DataManagerNode
from skillwing.services.managers.resource_manager import ResourceManagerNode
from skillwing.services.mocking.system import make_mock_skill
from skillwing.services.protocol import (
    AttachManager,
    BeginGoal,
    EndGoal,
    ErrorReply,
    GoalVerdict,
    InterruptGoal,
    RecordOutcome,
    StartGoal,
)

GOALS = int(os.environ.get("SOAK_GOALS", "4000"))
"""Number of goals for the cores. Whole managers get a tenth of it, but enough to forget some."""
WHOLE_GOALS = max(1300, GOALS // 10)
SKILLSET = parse(
    """
    skillset line {
        data { load: float64 period=0.1 }
        resource belt { initial FREE  FREE -> TAKEN  TAKEN -> FREE }
        skill pack {
            effect { take: belt -> TAKEN  drop: belt -> FREE }
            precondition { free: resource=(belt == FREE)  success take }
            interrupt { apply=drop }
            result { success PACKED: apply=drop }
        }
    }
    """
)


class Goals:
    """Both cores of a skill, without the network."""

    def __init__(self) -> None:
        records = count()
        self.resources = ResourceCore(SKILLSET, source="rm", new_record_id=lambda: f"r{next(records)}")
        self.skill = SkillCore(
            SKILLSET, "pack", source="skill/pack", new_record_id=lambda: f"s{next(records)}", incarnation="one"
        )
        attach = AttachManager(manager="skill/pack", incarnation="one", schema=SKILLSET.schema_hash)
        self.resources.step(attach, 0.0)
        self.number = 0

    def run(self, goals: int) -> None:
        """Run goals to their end, each with others that get no grant: a start while another goal runs, one that was
        interrupted before, and one with an unknown input. Also interrupt a goal that never starts."""
        for _ in range(goals):
            self.number += 1
            now = float(self.number)
            goal_id = f"goal-{self.number}"
            for never_begun in (f"never-{self.number}", f"early-{self.number}"):
                with contextlib.suppress(RefusedError):
                    self.skill.step(InterruptGoal(goal_id=never_begun, client="c"), now)
            self._perform(self.skill.step(self._start(f"early-{self.number}"), now), now)
            self._perform(self.skill.step(self._start(f"wrong-{self.number}", inputs={"haste": 1.0}), now), now)
            self._perform(self.skill.step(self._start(goal_id), now), now)
            self._perform(self.skill.step(self._start(f"busy-{self.number}"), now), now)
            self._perform(self.skill.step(Terminated(goal_id, "PACKED"), now), now)
            assert self.skill.current is None
            assert not self.resources.grants

    def leave_unheard(self) -> None:
        """End as many goals as can wait for a commit at once, without any answer from the resource manager."""
        now = float(self.number)
        for number in range(PENDING_OUTCOMES_LIMIT):
            start = self._start(f"unheard-{number}", inputs={"haste": 1.0})
            questions, asked = self._questions(self.skill.step(start, now)), 0
            while questions:
                asked += 1
                questions = self._questions(self.skill.step(QuestionAnswered(questions[0], None), now))
            assert asked == SILENCES_UNTIL_ABANDONED

    def _questions(self, actions: tuple[object, ...]) -> list[AskResources]:
        return [action for action in actions if isinstance(action, AskResources)]

    def _start(self, goal_id: str, inputs: dict[str, object] | None = None) -> StartGoal:
        return StartGoal(goal_id=goal_id, inputs=inputs or {}, client="c", schema=SKILLSET.schema_hash)

    def _perform(self, actions: tuple[object, ...], now: float) -> None:
        for action in actions:
            match action:
                case CallHook(hook=Hook.VALIDATE, goal_id=goal_id):
                    self._perform(self.skill.step(Validated(goal_id), now), now)
                case CallHook(hook=Hook.DISPATCH, goal_id=goal_id):
                    self._perform(self.skill.step(Dispatched(goal_id), now), now)
                case AskResources(call=call):
                    self._perform(self.skill.step(QuestionAnswered(action, self._judged(call, now)), now), now)
                case _:
                    pass

    def _judged(self, call: BeginGoal | EndGoal | RecordOutcome, now: float) -> GoalVerdict | ErrorReply:
        try:
            return self.resources.step(call, now).reply
        except RefusedError as refusal:
            return refusal.reply


def test_a_memory_that_grows_is_noticed() -> None:
    goals = Goals()
    goals.run(10)
    held = items_held([goals.resources, goals.skill])
    goals.run(10)
    assert items_held([goals.resources, goals.skill]) > held


def test_cores_forget_old_goals() -> None:
    goals = Goals()
    goals.run(GOALS // 2)
    held = items_held([goals.resources, goals.skill])
    goals.run(GOALS // 2)
    assert items_held([goals.resources, goals.skill]) == held


def test_a_manager_forgets_goals_of_which_the_resource_manager_never_hears() -> None:
    goals = Goals()
    goals.run(GOALS_REMEMBERED)
    held = items_held(goals.skill)
    goals.leave_unheard()
    assert items_held(goals.skill) <= held  # their answers name no input


def test_managers_and_clients_forget_old_goals() -> None:
    """The event histories of the bus, which stand for the caches of Zenoh's publishers, are counted, too."""
    network = InProcessNetwork()
    managers = [DataManagerNode(SKILLSET), ResourceManagerNode(SKILLSET), make_mock_skill(SKILLSET, "pack")]
    for node in managers:
        network.attach(node)
    client = SkillsetInterface(network.bus("client"), SKILLSET, client="client")
    network.run_for(1.0)

    def run(goals: int) -> None:
        for _ in range(goals):
            handle = client.start("pack")
            assert network.run_until(lambda handle=handle: handle.terminal is not None, 30.0)
            assert handle.terminal is not None
        network.run_for(15.0)  # retries and leases are over

    run(WHOLE_GOALS)
    held = items_held([managers, client])
    run(WHOLE_GOALS)
    # The number of timers and messages under way varies; a memory of each goal would be thousands of items.
    assert items_held([managers, client]) - held < 100
