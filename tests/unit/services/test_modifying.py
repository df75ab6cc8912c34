"""New inputs for a running goal."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import pytest
from rig import RIG
from skill_desk import Desk, dispatching, interrupting, running, validating

from skillwing.services.core.refusal import RefusedError
from skillwing.services.core.skill_actions import CallHook, Hook
from skillwing.services.protocol import ErrorCode, GoalStatus, Granted, ModifyGoal, State


def modify(desk: Desk, inputs: dict[str, Any], request_id: str = "m1", **fields: Any) -> None:
    known: dict[str, Any] = {"goal_id": "g", "client": "test", "schema": RIG.schema_hash, "cause": "mission#7"}
    desk.step(ModifyGoal(request_id=request_id, inputs=inputs, **(known | fields)))


def refusal(desk: Desk, inputs: dict[str, Any], **fields: Any) -> RefusedError:
    before = len(desk.actions)
    with pytest.raises(RefusedError) as refused:
        modify(desk, inputs, **fields)
    assert len(desk.actions) == before, "a refusal changes nothing"
    return refused.value


def calls(desk: Desk) -> list[CallHook]:
    return [action for action in desk.actions if isinstance(action, CallHook)]


def test_accepted_inputs_are_those_of_the_goal_from_then_on() -> None:
    desk = running()
    modify(desk, {"speed": 2})
    assert calls(desk)[-1].hook is Hook.VALIDATE
    assert calls(desk)[-1].inputs == {"speed": 2.0, "label": "a"}
    desk.validated()
    assert (calls(desk)[-1].hook, calls(desk)[-1].inputs) == (Hook.MODIFY, {"speed": 2.0, "label": "a"})
    desk.core.modifications.require_accepted("m1")
    status = desk.core.status("g")
    assert (status.state, status.revision, status.cause) == (State.RUNNING, 1, "mission#7")
    assert (status.before, status.text) == (State.RUNNING, "test modified `speed` to 2.0")
    desk.interrupt()
    assert calls(desk)[-1].inputs == {"speed": 2.0, "label": "a"}


def test_the_status_is_published_before_the_hook_is_called() -> None:
    desk = running()
    modify(desk, {"speed": 2.0})
    desk.validated()
    told, called = desk.actions[-2:]
    assert isinstance(told, GoalStatus) and told.revision == 1
    assert isinstance(called, CallHook) and called.hook is Hook.MODIFY


@pytest.mark.parametrize("problem", ["Too fast here.", "Why?"])
def test_inputs_that_validate_refuses_change_nothing(problem: str) -> None:
    desk = running()
    modify(desk, {"speed": 2.0})
    desk.validated(problem)
    with pytest.raises(RefusedError, match=re.escape(problem)) as refused:
        desk.core.modifications.require_accepted("m1")
    assert refused.value.code is ErrorCode.NOT_ALLOWED
    assert desk.core.status("g").revision == 0
    desk.interrupt()
    assert calls(desk)[-1].inputs == {"speed": 1.0, "label": "a"}


@pytest.mark.parametrize("problem", [None, "Too fast here."])
def test_a_repeated_request_is_answered_and_changes_nothing(problem: str | None) -> None:
    desk = running()
    modify(desk, {"speed": 2.0})
    desk.validated(problem)
    before = list(desk.actions)
    modify(desk, {"speed": 2.0})
    desk.interrupt()
    modify(desk, {"speed": 2.0})
    assert [action for action in desk.actions if isinstance(action, CallHook)][:-1] == [
        action for action in before if isinstance(action, CallHook)
    ]


def test_several_modifications_are_counted() -> None:
    desk = running()
    for number, speed in enumerate((2.0, 2.5, 3.0), start=1):
        modify(desk, {"speed": speed}, request_id=f"m{number}")
        desk.validated()
        assert desk.core.status("g").revision == number
    assert calls(desk)[-1].inputs["speed"] == 3.0


@pytest.mark.parametrize(
    ("make", "code"),
    [
        (validating, ErrorCode.UNAVAILABLE),
        (dispatching, ErrorCode.UNAVAILABLE),
        (interrupting, ErrorCode.NOT_ALLOWED),
        (Desk, ErrorCode.UNKNOWN_GOAL),
    ],
)
def test_only_a_running_goal_is_modified(make: Callable[[], Desk], code: ErrorCode) -> None:
    assert refusal(make(), {"speed": 2.0}).code is code


def test_a_refusal_for_an_unknown_goal_counts_also_if_the_request_arrives_again_after_the_start() -> None:
    desk = Desk()
    assert refusal(desk, {"speed": 2.0}).code is ErrorCode.UNKNOWN_GOAL
    desk.start()
    desk.validated()
    desk.granted()
    desk.dispatched()
    modify(desk, {"speed": 2.0})
    assert Hook.MODIFY not in desk.hooks
    with pytest.raises(RefusedError) as refused:
        desk.core.modifications.require_accepted("m1")
    assert refused.value.code is ErrorCode.UNKNOWN_GOAL
    assert desk.core.status("g").revision == 0


def test_a_goal_that_ends_or_has_ended_is_not_modified() -> None:
    desk = running()
    desk.terminated()
    assert refusal(desk, {"speed": 2.0}).code is ErrorCode.NOT_ALLOWED
    desk.ended()
    assert "TERMINATED" in refusal(desk, {"speed": 2.0}).message


@pytest.mark.parametrize(
    ("inputs", "fields", "code", "sentence"),
    [
        ({"label": "b", "speed": 2.0}, {}, ErrorCode.NOT_ALLOWED, "keeps `label`"),
        ({"sped": 2.0}, {}, ErrorCode.UNKNOWN_NAME, "sped"),
        ({}, {}, ErrorCode.NOT_ALLOWED, "No input is named"),
        ({"speed": 99.0}, {}, ErrorCode.BAD_REQUEST, "speed"),
        ({"speed": "fast"}, {}, ErrorCode.BAD_REQUEST, "speed"),
        ({"speed": 2.0}, {"deadline": -1.0}, ErrorCode.TOO_LATE, "after its deadline"),
        ({"speed": 2.0}, {"schema": "0" * 16}, ErrorCode.SCHEMA_MISMATCH, "version"),
    ],
)
def test_what_does_not_fit_is_refused(
    inputs: dict[str, Any], fields: dict[str, Any], code: ErrorCode, sentence: str
) -> None:
    refused = refusal(running(), inputs, **fields)
    assert refused.code is code
    assert sentence in refused.message


@pytest.mark.parametrize("end", [Desk.raised, Desk.terminated, Desk.failed, Desk.violated, Desk.interrupt])
def test_a_goal_that_is_ended_while_new_inputs_are_validated_keeps_its_own(end: Callable[[Desk], None]) -> None:
    desk = running()
    modify(desk, {"speed": 2.0})
    end(desk)
    desk.validated()
    with pytest.raises(RefusedError, match="ended before") as refused:
        desk.core.modifications.require_accepted("m1")
    assert refused.value.code is ErrorCode.NOT_ALLOWED
    assert Hook.MODIFY not in desk.hooks


def test_a_renewal_does_not_disturb_a_modification() -> None:
    desk = running()
    desk.renewed(None)
    modify(desk, {"speed": 2.0})
    with pytest.raises(RefusedError) as undecided:
        desk.core.modifications.require_accepted("m1")
    assert undecided.value.code is ErrorCode.UNAVAILABLE
    desk.renewed(Granted(goal_id="g", token=7, step=1, record="rm#1"))
    assert refusal(desk, {"speed": 3.0}, request_id="m2").code is ErrorCode.UNAVAILABLE
    desk.validated()
    desk.core.modifications.require_accepted("m1")
    assert desk.core.status("g").revision == 1


def test_a_modification_does_not_extend_the_deadline() -> None:
    desk = running()
    desk.wait(59.0)
    modify(desk, {"speed": 2.0})
    desk.validated()
    desk.wait(1.0)
    assert desk.state is State.INTERRUPTING
