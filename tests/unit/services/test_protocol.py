"""Messages that can be sent, and messages that cannot."""

from __future__ import annotations

import subprocess
import sys
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


THREADS = """
import contextlib, sys, threading
from msgspec import Struct
from skillwing.services import protocol
sys.setswitchinterval(1e-6)
kinds = [each for each in vars(protocol).values() if isinstance(each, type) and issubclass(each, Struct)]
here = threading.Barrier(6)
def read():
    here.wait()
    for kind in kinds:
        protocol._decoders.clear()
        for payload in (bytes([0x80]), bytes([0x81, 0xA6]) + b"record" + bytes([0x81, 0xA1]) + b"a" + bytes([0xC0])):
            with contextlib.suppress(protocol.ProtocolError):
                protocol.decode(payload, kind)
threads = [threading.Thread(target=read) for _ in range(6)]
[each.start() for each in threads]
[each.join() for each in threads]
"""


def test_threads_may_begin_to_read_messages_at_once() -> None:
    # Without the lock a process ends with SIGSEGV now and then, one of ten to forty on two cores.
    running = [subprocess.Popen([sys.executable, "-c", THREADS]) for _ in range(24)]
    assert [each.wait() for each in running] == [0] * len(running)
