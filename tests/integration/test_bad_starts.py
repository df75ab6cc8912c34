"""Oversized and useless starts, names and samples: the receiver stays alive and names the problem."""

from __future__ import annotations

from typing import Any

import pytest

from skillwing.dsl import parse
from skillwing.services.bus import Answer, Answered
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.client.interface import SkillsetInterface
from skillwing.services.errors import InvalidOptionError
from skillwing.services.managers.data_manager import DataManagerNode
from skillwing.services.managers.hooks import Goal, SkillHooks
from skillwing.services.managers.resource_manager import ResourceManagerNode
from skillwing.services.managers.skill_manager import SkillManagerNode
from skillwing.services.protocol import (
    MAX_MESSAGE_BYTES,
    DataSample,
    Ending,
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
    line.start("bad", **inputs)
    refused = line.status("bad")
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


@pytest.mark.parametrize("taken", [True, False], ids=["after it took the goal", "before it took the goal"])
def test_a_manager_that_fails_on_a_start_is_asked_whether_it_has_taken_the_goal(
    taken: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    start = SkillManagerNode._answer_start

    def failing(node: SkillManagerNode, request: StartGoal, key: str) -> GoalStatus:
        if taken:
            start(node, request, key)
        raise OSError("no space left on device")

    monkeypatch.setattr(SkillManagerNode, "_answer_start", failing)
    line = Line()
    goal = SkillsetInterface(line.bus, PACKING, client="test").start("pack", {"path": []})
    line.network.run_for(0.2)
    if taken:
        assert goal.state is State.RUNNING
    else:
        assert goal.terminal is not None
        assert goal.terminal.ending is Ending.ERROR
        assert "no space left on device" in goal.terminal.reason


@pytest.mark.parametrize("name", ["", "a/b", "*", "a$*", "who?", "#1", "x" * 101])
def test_a_client_whose_token_nobody_could_see_is_refused(name: str) -> None:
    with pytest.raises(InvalidOptionError, match="A client cannot be called"):
        SkillsetInterface(Line().bus, PACKING, client=name, owns_goals=True)


def test_the_data_manager_remembers_no_names_that_strangers_choose(caplog: pytest.LogCaptureFixture) -> None:
    network, manager = InProcessNetwork(), DataManagerNode(PACKING)
    network.attach(manager)
    bus = network.bus("stranger")
    for number in range(100):
        bus.advertise(KEYS.data(f"x{number}")).put(b"junk")
        bus.advertise(KEYS.data(f"y{number}")).put(encode(DataSample(name=f"y{number}", value=1.0, t=0.0)))
    network.run_for(1.0)
    [complaint] = [entry for entry in caplog.records if entry.name.endswith("data_manager")]
    assert "x0" in complaint.getMessage()
