"""The RGB camera and its live video."""

from __future__ import annotations

from typing import Annotated

import msgspec

from skillwing.onboard.topics.common import Done, Vector3
from skillwing.onboard.topics.processes import BRIDGE, GROUND, LINK, RECORDER, SKILLS, VEHICLE, VIDEO
from skillwing.onboard.topics.rows import arrays, query, stream
from skillwing.services.protocol import ErrorCode, Label, Message, Time
from skillwing.services.wire.channel import Channel, Duty

CAMERA = "fl/camera/image"
CAMERA_COMMAND = "fl/camera/command"
VIDEO_COMMAND = "fl/video/command"
VIDEO_ENCODER = "fl/video/encoder"
VIDEO_SENT = "fl/video/sent"
VIDEO_RECEIVED = "fl/video/received"
VIDEO_REPORT = "fl/video/report"
VIDEO_STATUS = "fl/video/status"
VIDEO_SHOWN = "fl/video/shown"


class CameraHeader(Message, frozen=True, kw_only=True):
    """Pinhole model of the RGB camera; `mount` is its position in FLU. Its optical axis is the body's x, turned down by
    `tilt` [rad]."""

    t: Time
    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    mount: Vector3
    tilt: float = 0.0


class ControlCamera(Message, frozen=True, kw_only=True):
    """Request pictures at this rate for the next `seconds`. Repeat it in time for a longer stream."""

    fps: Annotated[float, msgspec.Meta(gt=0.0, le=50.0)]
    seconds: Annotated[float, msgspec.Meta(ge=0.0, le=60.0)]
    tilt: Annotated[float, msgspec.Meta(ge=-1.6, le=1.6)] = 0.0


class ControlVideo(Message, frozen=True, kw_only=True):
    """Start or stop the live video of a goal. `min_fps` and `min_quality` are the ground's demands: the sender chooses
    the trade-off between the two."""

    goal_id: Label
    token: int
    run: bool
    min_fps: float = 10.0
    min_quality: float = 0.7


class EncoderStatus(Message, frozen=True, kw_only=True):
    """Rates that the sender aims at: `bitrate` [bit/s], `fps`. `changes` counts the changes of either."""

    t: Time
    stream: Label
    bitrate: float
    fps: float
    changes: int


class VideoPacket(Message, frozen=True, kw_only=True):
    """One of `parts` packets of picture number `frame`, taken at `t`, that has `size` bytes in all.

    `sequence` counts the packets of a stream. Part numbers from `parts` on are the `parity` packets. Any `parts` of all
    packets make the picture (`skillwing.onboard.video.erasure`).
    """

    t: Time
    stream: Label
    sequence: int
    frame: int
    part: Annotated[int, msgspec.Meta(ge=0, le=4096)]
    parts: Annotated[int, msgspec.Meta(ge=1, le=4096)]
    size: Annotated[int, msgspec.Meta(ge=0, le=4096 * 1200)]
    keyframe: bool
    parity: Annotated[int, msgspec.Meta(ge=0, le=255)] = 0


class VideoStatus(Message, frozen=True, kw_only=True):
    """Reception on the ground over the last second: pictures shown, `bitrate` [bit/s], share of packets `lost`, median
    time from shutter to screen [s]. `quality` is the SSIM of pictures shown, None while there are none."""

    t: Time
    stream: Label
    fps: float
    quality: float | None
    bitrate: float
    lost: float
    latency: float | None
    wants_keyframe: bool = False


class VideoShown(Message, frozen=True, kw_only=True):
    t: Time
    width: int
    height: int


SENDING, RECEIVING = "while a stream runs", "while a stream comes in"
PIXELS, PACKET = "uint8 [height, width, 3]: RGB", "a packet of an H.264 access unit, or of its parity"
TOPICS: tuple[Channel, ...] = (
    arrays(
        CAMERA, CameraHeader, VEHICLE, (VIDEO, GROUND), Duty.SOME, PIXELS, when="at the requested rate, while requested"
    ),
    query(CAMERA_COMMAND, ControlCamera, Done, VEHICLE, (VIDEO,), Duty.SOME),
    query(VIDEO_COMMAND, ControlVideo, Done, VIDEO, (SKILLS,), Duty.SOME, ErrorCode.STALE_TOKEN),
    stream(VIDEO_ENCODER, EncoderStatus, VIDEO, (SKILLS,), Duty.SOME, rate=2.0, when=SENDING),
    arrays(VIDEO_SENT, VideoPacket, VIDEO, (LINK,), Duty.SOME, PACKET, when=SENDING),
    arrays(VIDEO_RECEIVED, VideoPacket, LINK, (GROUND,), Duty.SOME, PACKET, when=SENDING),
    stream(VIDEO_REPORT, VideoStatus, GROUND, (LINK,), Duty.SOME, rate=4.0, when=RECEIVING),
    stream(VIDEO_STATUS, VideoStatus, LINK, (VIDEO, SKILLS, BRIDGE, RECORDER), Duty.SOME, rate=4.0, when=RECEIVING),
    arrays(VIDEO_SHOWN, VideoShown, GROUND, (RECORDER,), Duty.TRIALS, "a JPEG file", when=f"at most 4 Hz, {RECEIVING}"),
)
