"""The RGB camera and its live video."""

from __future__ import annotations

from typing import Annotated

import msgspec

from skillwing.onboard.topics.common import Vector3
from skillwing.services.protocol import Label, Message, Time

CAMERA = "fl/camera/image"  # uint8 [height, width, 3] RGB, CameraHeader; only while a client asks for pictures
CAMERA_COMMAND = "fl/camera/command"  # query ControlCamera -> Done
VIDEO_COMMAND = "fl/video/command"  # query ControlVideo -> Done
VIDEO_ENCODER = "fl/video/encoder"  # EncoderStatus, 2 Hz while a stream runs
VIDEO_SENT = "fl/video/sent"  # a packet of an H.264 access unit, VideoPacket; video -> link
VIDEO_RECEIVED = "fl/video/received"  # the packets that the link has not lost; link -> ground
VIDEO_REPORT = "fl/video/report"  # VideoStatus, 4 Hz while a stream comes in; ground -> link
VIDEO_STATUS = "fl/video/status"  # the same once it is back on board; link -> video and other readers
VIDEO_SHOWN = "fl/video/shown"  # JPEG of what the ground sees, VideoShown, at most 4 Hz


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
