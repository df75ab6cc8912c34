"""Starts that are too much, in one way or another, and what becomes of those that come after them."""

from __future__ import annotations

from typing import Any

import pytest

from skillwing.dsl import parse
from skillwing.services.bus import Answer, Answered
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.managers.hooks import Goal, SkillHooks
from skillwing.services.managers.resource_manager import ResourceManagerNode
from skillwing.services.managers.skill_manager import SkillManagerNode
from skillwing.services.protocol import (
    MAX_MESSAGE_BYTES,
    GoalStatus,
    Keys,
    ProtocolError,
    QueryGoal,
    Record,
    StartGoal,
    State,
    decode,
    encode,
)
from skillwing.services.timeline import Timeline

PACKING = parse(
    """
    skillset line {
        resource belt { initial FREE  FREE -> TAKEN  TAKEN -> FREE }
        skill pack {
            input { path: float64[] }
            effect { take: belt -> TAKEN  drop: belt -> FREE }
            precondition { free: resource=(belt == FREE)  success take }
            interrupt { apply=drop timeout=1.0 }
            result { success PACKED: apply=drop }
        }
    }
    """
)
KEYS = Keys("line")


class Packing(SkillHooks[Any, Any, Any]):
    skill = "pack"

    def __init__(self) -> None:
        self.dispatched: list[str] = []

    def on_dispatch(self, goal: Goal[Any]) -> None:
        self.dispatched.append(goal.id)


class Line:
    """The managers of the line, and somebody who asks them without our client in between."""

    def __init__(self) -> None:
        self.network = InProcessNetwork()
        self.hooks = Packing()
        self.network.attach(ResourceManagerNode(PACKING))
        self.network.attach(SkillManagerNode(self.hooks, PACKING))
        self.bus = self.network.bus("client")
        self.network.run_for(0.1)

    def start(self, goal_id: str, **inputs: object) -> GoalStatus:
        request = StartGoal(goal_id=goal_id, inputs=inputs, client="test", schema=PACKING.schema_hash)
        return self._asked(KEYS.start("pack"), encode(request))

    def status(self, goal_id: str) -> GoalStatus:
        return self._asked(KEYS.goal("pack"), encode(QueryGoal(goal_id=goal_id)))

    def _asked(self, key: str, payload: bytes) -> GoalStatus:
        answers: list[Answer] = []
        self.bus.ask(key, payload, answers.append)
        self.network.run_for(0.2)
        [answer] = answers
        assert isinstance(answer, Answered), answer
        return decode(answer.payload, GoalStatus)


TOO_MUCH: list[dict[str, object]] = [
    {f"f{number:06d}": 0 for number in range(40_000)},
    {"x" * (MAX_MESSAGE_BYTES // 2): 0},
    {"path": [None] * 100_000},
    {"path": [0] * 120_000},
]


@pytest.mark.parametrize("inputs", TOO_MUCH, ids=["many names", "a long name", "a wrong list", "a list that grows"])
def test_a_start_that_is_too_much_is_not_validated_and_in_nobodys_way(inputs: dict[str, object]) -> None:
    line = Line()
    refused = line.start("bad", **inputs)
    assert refused.terminal is not None
    assert refused.terminal.label == "NV"
    assert refused.terminal.reason
    assert len(encode(refused)) < 10_000

    line.start("good", path=[0, 1])
    assert line.status("good").state is State.RUNNING
    assert line.hooks.dispatched == ["good"]


def test_what_cannot_be_published_is_left_out_and_the_goal_has_its_way(monkeypatch: pytest.MonkeyPatch) -> None:
    line = Line()
    publish = Timeline.publish

    def failing(timeline: Timeline, record: Record) -> None:
        if record.after == State.VALIDATING:
            raise ProtocolError("it is too long")
        publish(timeline, record)

    monkeypatch.setattr(Timeline, "publish", failing)
    line.start("g", path=[])
    assert line.status("g").state is State.RUNNING
    assert line.hooks.dispatched == ["g"]
