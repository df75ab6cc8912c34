"""Text of `skillwing ready`."""

from __future__ import annotations

from skillwing.services.protocol import FailingCheck, Holder, MissingState, SkillReady
from skillwing.services.terminal.ready_text import lines, rows

GOAL = Holder(skill="lift", goal_id="g1", owner="shift")
FREE = FailingCheck(
    name="free",
    reason="`arm == FREE` does not hold: arm is TAKEN.",
    missing=(MissingState(resource="arm", state="TAKEN", wanted=("FREE",), holder=GOAL),),
)
LOOSE = FailingCheck(
    name="loose",
    reason="`brake == LOOSE` does not hold: brake is SET.",
    missing=(MissingState(resource="brake", state="SET", wanted=("LOOSE",), events=("unlock",)),),
)
TURN = SkillReady(skill="turn", ready=False, failing=(FREE, LOOSE))


def test_a_ready_skill_has_one_line() -> None:
    assert list(lines(SkillReady(skill="turn", ready=True), [])) == ["turn is ready."]


def test_advice_follows_the_reasons() -> None:
    assert list(lines(TURN, ["free: advice.", "loose: advice."])) == [
        "turn is not ready.",
        "  free: `arm == FREE` does not hold: arm is TAKEN.",
        "  loose: `brake == LOOSE` does not hold: brake is SET.",
        "  free: advice.",
        "  loose: advice.",
    ]


def test_holders_are_named_also_if_there_is_no_advice() -> None:
    assert list(lines(TURN, None)) == [
        "turn is not ready.",
        "  free: `arm == FREE` does not hold: arm is TAKEN.",
        "  `lift` holds `arm` for goal g1 of shift.",
        "  loose: `brake == LOOSE` does not hold: brake is SET.",
    ]


def test_a_running_goal_without_a_known_client() -> None:
    busy = SkillReady(skill="lift", ready=False, running=Holder(skill="lift", goal_id="g1"))
    assert list(lines(busy, [])) == ["lift is not ready.", "  The skill runs goal g1."]


def test_unchecked_preconditions_are_named() -> None:
    open_ = SkillReady(skill="lift", ready=True, unchecked=("light",))
    assert list(lines(open_, [])) == [
        "lift is ready.",
        "  Not checked without inputs: light. Give them: `skillwing ready lift NAME=VALUE`.",
    ]


def test_the_table_has_a_row_for_each_skill() -> None:
    ready = SkillReady(skill="lift", ready=True)
    assert rows([ready, TURN], {}) == [
        ("lift", "yes", ""),
        (
            "turn",
            "no",
            "free: `arm == FREE` does not hold: arm is TAKEN. `lift` holds `arm` for goal g1 of shift. "
            "loose: `brake == LOOSE` does not hold: brake is SET.",
        ),
    ]
    assert rows([ready], {"lift": "It hangs."}) == [("lift", "no", "It hangs.")]


def test_a_skill_whose_manager_is_in_trouble_is_not_ready() -> None:
    ready = SkillReady(skill="lift", ready=True)
    assert list(lines(ready, [], "It hangs.")) == ["lift is not ready.", "  It hangs."]
