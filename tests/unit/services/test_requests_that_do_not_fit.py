"""Requests that are malformed, or of another skillset, are refused and leave no trace."""

from __future__ import annotations

from typing import Any

import msgspec
import pytest
from rig import RIG, Bench, granted

from skillwing.services.core.checks import LONGEST_GOAL_ID
from skillwing.services.core.refusal import RefusedError
from skillwing.services.protocol import (
    BeginGoal,
    EndGoal,
    EndKind,
    ErrorCode,
    FireEvent,
    FireExtern,
    ProtocolError,
    decode,
    encode,
)


@pytest.mark.parametrize(
    ("how", "result", "token", "code"),
    [
        (EndKind.RESULT, "DONE", 99, ErrorCode.STALE_TOKEN),
        (EndKind.RESULT, "DOEN", None, ErrorCode.UNKNOWN_NAME),
        (EndKind.RESULT, None, None, ErrorCode.BAD_REQUEST),
    ],
)
def test_a_malformed_end_frees_nothing(
    bench: Bench, how: EndKind, result: str | None, token: int | None, code: ErrorCode
) -> None:
    real = granted(bench.begin("move", "g")).token
    with pytest.raises(RefusedError) as refusal:
        bench.end("move", "g", token or real, how, result)
    assert refusal.value.code is code
    assert bench.core.states["axes"] == "USED"


def test_ends_of_unknown_goals_and_borrowed_ids_are_refused(bench: Bench) -> None:
    with pytest.raises(RefusedError) as refusal:
        bench.end("move", "nobody", 1, result="DONE")
    assert refusal.value.code is ErrorCode.UNKNOWN_GOAL
    bench.begin("move", "g")
    with pytest.raises(RefusedError, match="belongs to `move`"):
        bench.begin("watch", "g")
    with pytest.raises(RefusedError, match="characters"):
        bench.begin("move", "x" * 1000)


def test_a_foreign_schema_is_refused_naming_both(bench: Bench) -> None:
    request = BeginGoal(goal_id="g", skill="move", inputs={}, manager="m", owner="o", schema="abcd")
    with pytest.raises(RefusedError) as refusal:
        bench.core.step(request, 0.0)
    assert refusal.value.code is ErrorCode.SCHEMA_MISMATCH
    assert "abcd" in str(refusal.value)
    assert RIG.schema_hash in str(refusal.value)


@pytest.mark.parametrize(
    ("inputs", "named"), [({"speed": "fast"}, "speed"), ({"sped": 1.0}, "sped"), ({"speed": 99.0}, "speed")]
)
def test_inputs_that_do_not_fit_are_refused_by_name_and_leave_no_trace(
    bench: Bench, inputs: dict[str, Any], named: str
) -> None:
    with pytest.raises(RefusedError, match=f"`{named}`") as refusal:
        bench.begin("move", "g", **inputs)
    assert refusal.value.code is ErrorCode.BAD_REQUEST
    assert bench.core.states["axes"] == "FREE"
    granted(bench.begin("move", "g"))


def test_who_speaks_of_another_version_of_the_skillset_moves_nothing(bench: Bench) -> None:
    for call in (
        lambda schema: bench.core.step(FireEvent(event="storm", source="test", schema=schema), 0.0),
        lambda schema: bench.core.step(
            FireExtern(resource="authority", target="OFF", source="test", schema=schema), 0.0
        ),
    ):
        with pytest.raises(RefusedError) as refusal:
            call("of another file")
        assert refusal.value.code is ErrorCode.SCHEMA_MISMATCH
        assert bench.core.states["authority"] == "ON"
        call(RIG.schema_hash)
        assert bench.core.states["authority"] == "OFF"
        bench.extern("authority", "ON")


@pytest.mark.parametrize(("length", "fits"), [(0, False), (1, True), (LONGEST_GOAL_ID, True)])
def test_a_goal_id_is_neither_empty_nor_without_bounds(bench: Bench, length: int, fits: bool) -> None:
    if fits:
        granted(bench.begin("move", "x" * length))
    for too_much in ("" if length == 0 else "x" * (LONGEST_GOAL_ID + 1),):
        with pytest.raises(RefusedError) as refusal:
            bench.begin("move", too_much)
        assert refusal.value.code is ErrorCode.BAD_REQUEST


def test_an_end_with_an_unknown_result_gets_the_valid_ones(bench: Bench) -> None:
    token = granted(bench.begin("move", "g")).token
    with pytest.raises(RefusedError) as refusal:
        bench.end("move", "g", token, EndKind.RESULT)
    assert refusal.value.known == tuple(result.name for result in bench.skillset.skill("move").results)
    assert refusal.value.help


def test_an_end_of_no_known_kind_cannot_be_read() -> None:
    end = EndGoal(goal_id="g", skill="move", token=1, how=EndKind.ERROR)
    fields = msgspec.msgpack.decode(encode(end))
    with pytest.raises(ProtocolError, match="ungranted"):
        decode(msgspec.msgpack.encode(fields | {"how": "ungranted"}), EndGoal)
