"""The leaf that asks whether a skill may start."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from fake_interface import FakeMission
from py_trees.common import Status

from skillwing.bt_missions.leaves.blackboard_entry import BlackboardEntry
from skillwing.bt_missions.leaves.may_start import ANSWER_PATIENCE, MayStart
from skillwing.services.bus import Answer, Answered, NoReply, Refused
from skillwing.services.protocol import (
    ErrorCode,
    ErrorReply,
    FailingCheck,
    Holder,
    MissingState,
    ReadyReport,
    SkillReady,
    encode,
)

HELD = FailingCheck(
    name="axes_free",
    reason="`axes == FREE` does not hold: axes is USED.",
    missing=(
        MissingState(resource="axes", state="USED", wanted=("FREE",), holder=Holder(skill="turn", goal_id="g-7")),
    ),
)
NOT_READY = SkillReady(skill="go", ready=False, failing=(HELD,))
READY = SkillReady(skill="go", ready=True)


def answered(ready: SkillReady) -> Answered:
    return Answered(encode(ReadyReport(step=1, t=0.0, skills=(ready,))))


def refused(code: ErrorCode) -> Refused:
    return Refused(ErrorReply(code=code, message="The sender has another version."))


class Asked:
    """A leaf in its tree, and the answers to its questions."""

    def __init__(self, mission: FakeMission, **options: Any) -> None:
        self.mission = mission
        self.leaf = MayStart("may go?", mission.context, "go", **options)

    def tick(self, at: float = 0.0) -> Status:
        self.mission.time = at
        self.leaf.tick_once()
        return self.leaf.status

    @property
    def reply(self) -> Callable[[Answer], None]:
        """Answers the latest question."""
        return self.mission.interface.questions[-1][2]


def test_a_skill_that_may_start_is_a_success_and_nothing_is_started(mission: FakeMission) -> None:
    asked = Asked(mission, inputs={"speed": 2.0})
    assert asked.tick() is Status.RUNNING
    assert [question[:2] for question in mission.interface.questions] == [("go", {"speed": 2.0})]
    asked.reply(answered(READY))
    assert asked.tick() is Status.SUCCESS
    assert not mission.goals
    assert mission.context.failure is None


def test_a_failure_names_what_is_missing_and_who_holds_it(mission: FakeMission) -> None:
    asked = Asked(mission)
    asked.tick()
    asked.reply(answered(NOT_READY))
    assert asked.tick() is Status.FAILURE
    why = "axes_free: `axes == FREE` does not hold: axes is USED. `turn` holds `axes` for goal g-7."
    text = f"go may not start: {why}"
    assert asked.leaf.feedback_message == text
    assert mission.context.failure is not None
    assert (mission.context.failure.text, mission.context.failure.record) == (text, "axes:changed")


def test_a_question_is_no_incident(mission: FakeMission) -> None:
    asked = Asked(mission, question=True)
    asked.tick()
    asked.reply(answered(NOT_READY))
    assert asked.tick() is Status.FAILURE
    assert mission.context.failure is None


def test_it_asks_again_as_long_as_it_may_wait(mission: FakeMission) -> None:
    asked = Asked(mission, wait=2.0)
    asked.tick()
    asked.reply(answered(NOT_READY))
    assert asked.tick(1.0) is Status.RUNNING
    assert "`turn` holds `axes`" in asked.leaf.feedback_message
    asked.reply(answered(READY))
    assert asked.tick(1.5) is Status.SUCCESS
    assert len(mission.interface.questions) == 2


@pytest.mark.parametrize(
    "answer", [None, NoReply(timed_out=True), refused(ErrorCode.UNAVAILABLE)], ids=["late", "none", "not yet"]
)
def test_a_resource_manager_that_does_not_answer_is_a_failure_in_bounded_time(
    mission: FakeMission, answer: Answer | None
) -> None:
    asked = Asked(mission)
    for at in (0.0, 1.0, ANSWER_PATIENCE - 0.1):
        assert asked.tick(at) is Status.RUNNING
        if answer is not None:
            asked.reply(answer)
    assert asked.tick(ANSWER_PATIENCE) is Status.FAILURE
    assert asked.leaf.feedback_message.endswith("the resource manager does not answer")


def test_a_refusal_is_final(mission: FakeMission) -> None:
    asked = Asked(mission, wait=60.0)
    asked.tick()
    asked.reply(refused(ErrorCode.SCHEMA_MISMATCH))
    assert asked.tick() is Status.FAILURE
    assert asked.leaf.feedback_message == "go may not start: The sender has another version."


def test_an_input_without_a_value_or_out_of_range_is_a_failure(mission: FakeMission) -> None:
    for speed, text in ((BlackboardEntry("fast"), "fast"), (500.0, "speed")):
        asked = Asked(mission, inputs={"speed": speed})
        assert asked.tick() is Status.FAILURE
        assert text in asked.leaf.feedback_message
    assert not mission.interface.questions


def test_an_answer_for_a_halted_leaf_is_not_for_its_next_run(mission: FakeMission) -> None:
    asked = Asked(mission)
    asked.tick()
    late = asked.reply
    asked.leaf.stop(Status.INVALID)
    late(answered(READY))
    assert asked.tick() is Status.RUNNING
    late(answered(READY))
    assert asked.tick() is Status.RUNNING
    asked.reply(answered(NOT_READY))
    assert asked.tick() is Status.FAILURE
