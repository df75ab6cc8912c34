"""The fake functional layer: what it answers, and how it misbehaves when it is told to."""

from __future__ import annotations

import pytest
from lifter import COMMAND, LIFTER, POSITION, Done, Go, Lift, Position

from skillwing.services.bus import Sample
from skillwing.services.core.refusal import RefusedError
from skillwing.services.protocol import ErrorCode, decode
from skillwing.services.testing import FakeLayer, SkillTest

READY = {"states": {"power": "ON"}, "data": {"load": 1.0}}


class Hoist(FakeLayer):
    """Goes up by a metre a second once it is asked to."""

    def setup(self) -> None:
        self.height, self.target = 0.0, 0.0
        self.answer(COMMAND, Go, self._go)
        self.bus.every(0.1, self._tick)

    def _go(self, command: Go) -> Done:
        self.target = command.height
        return Done()

    def _tick(self) -> None:
        self.height = min(self.target, self.height + 0.1)
        self.publish(POSITION, Position(height=self.height))


def test_a_layer_of_ones_own_lives_in_virtual_time() -> None:
    test = SkillTest(LIFTER, Lift, layer=Hoist(), **READY)
    goal = test.start(height=3.0)
    goal.assert_ended("S_UP", within=4.0)
    assert test.now() == pytest.approx(3.0, abs=0.3)
    assert test.layer.heard(POSITION) == [], "its own publications are not news to it"


def test_a_refusal_and_a_deaf_ear() -> None:
    test = SkillTest(LIFTER, Lift, layer=Hoist(), **READY)
    test.layer.refusal = "the hoist is locked"
    goal = test.start(height=3.0)
    goal.assert_ended("S_JAMMED")
    assert test.layer.asked(COMMAND, Go) == [Go(goal_id=goal.id, height=3.0)]
    test.layer.refusal, test.layer.deaf = None, 1
    test.start(height=3.0).assert_ended("S_JAMMED", within=5.0)
    assert len(test.layer.asked(COMMAND, Go)) == 1, "what was not heard was not asked"
    test.start(height=3.0).assert_ended("S_UP")


def test_answers_can_be_declared_before_and_replaced_afterwards() -> None:
    def refuse(command: Go) -> Done:
        raise RefusedError(ErrorCode.NOT_ALLOWED, f"{command.height} m is too high")

    layer = FakeLayer()
    layer.answer(COMMAND, Go, refuse)
    test = SkillTest(LIFTER, Lift, layer=layer, **READY)
    test.start(height=3.0).assert_ended("S_JAMMED")
    layer.answer(COMMAND, Go, Done())
    test.start(height=3.0).assert_running()


def test_arrays_go_with_their_header() -> None:
    test = SkillTest(LIFTER, Lift)
    seen: list[Sample] = []
    test.bus.subscribe("fl/scan", seen.append)
    test.layer.publish_array("fl/scan", Position(height=1.0), b"\1\2\3")
    test.run(0.1)
    assert (seen[0].payload, decode(seen[0].attachment, Position)) == (b"\1\2\3", Position(height=1.0))


def test_a_layer_without_a_bench_says_so() -> None:
    with pytest.raises(RuntimeError, match="on no bus yet"):
        FakeLayer().publish(POSITION, Position(height=1.0))
