"""What goes over the wire, and what does not."""

from __future__ import annotations

from typing import Any

import pytest

from skillwing.services.protocol import (
    MAX_MESSAGE_BYTES,
    MAX_NESTING,
    DataSample,
    InterruptGoal,
    ProtocolError,
    decode,
    encode,
)


def nested(levels: int) -> Any:
    return [nested(levels - 1)] if levels else 0


@pytest.mark.parametrize(
    "value",
    [2**70, float("nan"), [float("inf")], "\ud800", object(), "x" * MAX_MESSAGE_BYTES, nested(MAX_NESTING + 1)],
    ids=["integer", "nan", "infinite", "surrogate", "object", "long", "nested"],
)
def test_what_no_receiver_would_take_is_not_sent(value: object) -> None:
    with pytest.raises(ProtocolError):
        encode(DataSample(name="load", value=value, t=0.0))


@pytest.mark.parametrize("value", [2**63, -1, 0.5, "text", None, nested(MAX_NESTING - 2)])
def test_what_is_sent_is_received(value: object) -> None:
    sample = DataSample(name="load", value=value, t=0.0)
    assert decode(encode(sample), DataSample) == sample


def test_names_that_are_remembered_are_short() -> None:
    with pytest.raises(ProtocolError):
        decode(encode(InterruptGoal(goal_id="g", client="c" * 1000)), InterruptGoal)
