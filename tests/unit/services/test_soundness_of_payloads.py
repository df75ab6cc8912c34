"""The check of a payload's bytes never misses what a walk through its values would find."""

from __future__ import annotations

import math
from typing import Any

import msgspec
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from skillwing.services.protocol import MAX_NESTING, DataSample, ProtocolError, decode, encode, require_finite

FLOATS = st.floats() | st.floats(width=32) | st.sampled_from([math.nan, math.inf, -math.inf, 1.7e308])
VALUES: st.SearchStrategy[Any] = st.recursive(
    FLOATS | st.integers(-(2**63), 2**63) | st.text() | st.none() | st.booleans(),
    lambda inner: st.lists(inner, max_size=5) | st.dictionaries(st.text(max_size=4), inner, max_size=4),
    max_leaves=40,
)


def nested(depth: int, value: object) -> object:
    for _ in range(depth):
        value = [value]
    return value


def is_sound(value: object) -> bool:
    try:
        require_finite(DataSample(name="x", value=value, t=0.0))
    except ProtocolError:
        return False
    return True


@given(VALUES)
@example(nested(MAX_NESTING - 1, 0.5))
@example(nested(MAX_NESTING, 0.5))
@example(nested(MAX_NESTING + 20, {}))
def test_what_a_walk_refuses_is_neither_sent_nor_taken(value: object) -> None:
    if is_sound(value):
        assert decode(encode(DataSample(name="x", value=value, t=0.0)), DataSample).value == value
        return
    with pytest.raises(ProtocolError):
        encode(DataSample(name="x", value=value, t=0.0))
    with pytest.raises(ProtocolError):
        decode(msgspec.msgpack.encode({"v": 2, "name": "x", "value": value, "t": 0.0}), DataSample)


@pytest.mark.parametrize("number", [b"\xca\x7f\x80\0\0", b"\xca\xff\xc0\0\0", b"\xca\x7f\xc0\0\1"])
def test_single_precision_is_no_way_around(number: bytes) -> None:
    payload = msgspec.msgpack.encode({"v": 2, "name": "x", "value": 0, "t": 0.0}).replace(b"value\0", b"value" + number)
    with pytest.raises(ProtocolError, match="not finite"):
        decode(payload, DataSample)
