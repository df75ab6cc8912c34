"""Findings of fuzzing, one test each."""

from __future__ import annotations

import msgspec
import pytest

from skillwing.dsl import parse
from skillwing.onboard.topics.flight import AutopilotSetpoint
from skillwing.onboard.topics.mapping import MapHeader
from skillwing.onboard.topics.sensors import Health, SensorStatus
from skillwing.onboard.topics.video import VideoPacket
from skillwing.services.core.resource_core import ResourceCore
from skillwing.services.protocol import (
    MAX_MESSAGE_BYTES,
    BeginGoal,
    ClockTick,
    DataSample,
    EndGoal,
    ErrorCode,
    ErrorReply,
    Message,
    ProtocolError,
    decode,
    encode,
)

ALMOST_TOO_LONG = "a" * (MAX_MESSAGE_BYTES - 100)


def test_a_refusal_that_quotes_a_huge_request_can_be_sent() -> None:
    """The refusal ended the resource manager: it was just above the size limit, and the request just below it."""
    error = ErrorReply(code=ErrorCode.UNKNOWN_NAME, message=f"There is no skill `{ALMOST_TOO_LONG}`.")
    told = decode(encode(error), ErrorReply)
    assert told.message.startswith("There is no skill `aaa")
    assert len(told.message) < 3000


def test_the_cause_of_an_end_is_a_label() -> None:
    """The record of a long cause was too long to be published, after the effect had been applied."""
    end = EndGoal(goal_id="g", skill="s", token=1, how="interrupt", cause=ALMOST_TOO_LONG[100:])
    with pytest.raises(ProtocolError, match="cause"):
        decode(encode(end), EndGoal)


@pytest.mark.parametrize("t", [1e308, -1e308, 2.0**64])
def test_a_time_that_no_clock_shows_is_refused(t: float) -> None:
    """Huge times ended the recorder, which stores nanoseconds."""
    refused(ClockTick(t=t), ClockTick)


def test_a_voxel_as_large_as_a_galaxy_is_refused() -> None:
    """The volume of the voxel ended the bridge."""
    refused(MapHeader(t=0.0, voxel_size=1e200, count=0, complete=True), MapHeader)


@pytest.mark.parametrize("field", ["id", "sensor", "reason", "cause"])
def test_health_that_fills_a_message_is_refused(field: str) -> None:
    """The fault's record repeats a cause three times. A long cause ended the bridge."""
    health = {"id": "1", "t": 0.0, "sensor": "zed", "status": SensorStatus.FAILED}
    refused(Health(**{**health, field: ALMOST_TOO_LONG[200:]}), Health)


def test_a_stream_whose_name_fills_a_message_is_refused() -> None:
    """The report on a stream contains its name and was a little too long. It ended the ground process."""
    packet = VideoPacket(
        t=0.0, stream=ALMOST_TOO_LONG[200:], sequence=0, frame=0, part=0, parts=1, size=0, keyframe=True
    )
    refused(packet, VideoPacket)


def test_a_setpoint_beyond_all_maps_is_refused() -> None:
    """The setpoint made the physics diverge."""
    still = (0.0, 0.0, 0.0)
    setpoint = AutopilotSetpoint(t=0.0, position=(1e300, 0.0, 0.0), velocity=still, heading=0.0, rotors=True)
    refused(setpoint, AutopilotSetpoint)


def test_a_verdict_does_not_quote_a_huge_datum() -> None:
    """Two preconditions on a huge datum would make the answer too long to be sent."""
    skillset = parse(
        """
        skillset reader {
            data { page: string }
            resource lamp { initial OFF  OFF -> ON  ON -> OFF }
            skill read {
                effect { on: lamp -> ON  off: lamp -> OFF }
                precondition { a: data=(page == "x")  b: data=(page == "y")  success on }
                interrupt { apply=off }
                result { success DONE: apply=off }
            }
        }
        """
    )
    core = ResourceCore(skillset, source="test", new_record_id=lambda: "r")
    core.step(DataSample(name="page", value=ALMOST_TOO_LONG, t=0.0), 0.0)
    begin = BeginGoal(
        goal_id="g", skill="read", inputs={}, manager="skill/read", owner="me", schema=skillset.schema_hash
    )
    step = core.step(begin, 0.0)
    for publication in (step.reply, *step.publications):
        assert encode(publication)


def refused(message: Message, kind: type[Message]) -> None:
    with pytest.raises(ProtocolError, match="not a valid"):
        decode(msgspec.msgpack.encode(message), kind)
