"""Findings of fuzzing, one test each."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest
import rerun as rr

from skillwing.dsl import parse
from skillwing.evaluation.dashboard.scene import Dashboard
from skillwing.onboard.topics.flight import AutopilotSetpoint
from skillwing.onboard.topics.mapping import MapHeader
from skillwing.onboard.topics.navigation import NAVIGATION, Navigation
from skillwing.onboard.topics.sensors import LIDAR, ZED_DEPTH, DepthHeader, Health, LidarHeader, SensorStatus
from skillwing.onboard.topics.video import VideoPacket
from skillwing.services.bus.inprocess import InProcessNetwork
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
from skillwing.sim_mujoco.world.kinds import make_site

ORIGIN = (0.0, 0.0, 0.0)
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


def test_a_scan_or_picture_of_another_size_does_not_end_the_dashboard() -> None:
    """A scan with one beam ended the recorder, which expected those of the robot's LiDAR."""
    network, recording = InProcessNetwork(), rr.RecordingStream("fuzz")
    memory = recording.memory_recording()
    Dashboard(recording, skillset="m600", site=make_site(1)).attach(network.bus("recorder"))
    bus = network.bus("sim")
    navigation = Navigation(
        t=0.0, position=ORIGIN, velocity=ORIGIN, quaternion=(1.0, 0.0, 0.0, 0.0), angular_velocity=ORIGIN, heading=0.0
    )
    streams = {key: bus.advertise(key) for key in (NAVIGATION, LIDAR, ZED_DEPTH)}
    streams[NAVIGATION].put(encode(navigation))
    for t, size in enumerate((16, 1, 32)):
        scan = LidarHeader(t0=float(t), t1=t + 0.1, columns=64, beams=size, mount=ORIGIN)
        streams[LIDAR].put(np.ones((64, size), np.float32).tobytes(), encode(scan))
        picture = DepthHeader(t=float(t), width=8 * size, height=64, fx=50.0, fy=50.0, cx=4.0, cy=32.0, mount=ORIGIN)
        streams[ZED_DEPTH].put(np.full((64, 8 * size), 900, np.uint16).tobytes(), encode(picture))
        network.run_for(0.1)
    assert len(memory.drain_as_bytes()) > 0


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
