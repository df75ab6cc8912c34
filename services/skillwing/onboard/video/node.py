"""The video process on board: pictures in, H.264 out, at rates that follow the link and the ground's reports."""

from __future__ import annotations

from typing import Any

import msgspec
import numpy as np

from skillwing.onboard.commands.authority import CommandAuthority
from skillwing.onboard.commands.service import CommandRefusedError, answer_with
from skillwing.onboard.topics import guidance, link, video
from skillwing.onboard.video.codec import Encoder
from skillwing.onboard.video.packets import cut
from skillwing.onboard.video.rate_control import HIGHEST_FPS, RateController
from skillwing.services.bus import Bus, Handle
from skillwing.services.bus.reading import message_reader, stream_reader
from skillwing.services.options import read_options
from skillwing.services.protocol import ErrorCode, encode

STATUS_PERIOD = 0.5
RENEWAL, LEASE = 1.0, 3.0
"""Period and duration of requests for pictures [s]: if the video process ends, the camera stops soon."""
CONGESTED = 0.4
"""Queue in the modem from which pictures are skipped [s]."""
KEYFRAME_PAUSE = 0.4
"""Least time between two keyframes, as the ground repeats requests while one crosses the link [s]."""


class Stream:
    """The stream of one goal: its encoder, its rates, its numbering."""

    def __init__(self, goal: str, min_fps: float, min_quality: float) -> None:
        self.goal = goal
        self.control = RateController(min_fps, min_quality)
        self.encoder: Encoder | None = None
        self.frame = self.sequence = 0
        self.keyframe_at = -KEYFRAME_PAUSE
        self.wants_keyframe = False


class VideoNode:
    """Shell around a `RateController` and an `Encoder`, both made for each stream."""

    name = "video"
    owns_clock = False

    def __init__(self, tilt: float = 0.0) -> None:
        self._tilt = tilt
        self._holder = CommandAuthority("video")
        self._stream: Stream | None = None
        self._queued = 0.0
        self._running: list[Handle] = []
        self._bus: Bus | None = None

    def attach(self, bus: Bus) -> None:
        self._bus = bus
        self._sent = bus.advertise(video.VIDEO_SENT)
        self._status = bus.advertise(video.VIDEO_ENCODER)
        bus.subscribe(guidance.AUTHORITY, message_reader(guidance.Revoked, self._on_revoked), events=True)
        bus.serve(video.VIDEO_COMMAND, answer_with(video.ControlVideo, self._on_command))

    def detach(self) -> None:
        """Do nothing: the camera stops without new requests for pictures."""

    # --- commands --------------------------------------------------------------------------------------------

    def _on_command(self, command: video.ControlVideo) -> str:
        holder = self._holder
        holder.require_fresh(command.goal_id, command.token)
        if command.run:
            _require_possible(command)
            holder.take(command.goal_id, command.token)
            return self._start(command)
        if holder.goal == command.goal_id:
            self._stop()
            return "stopped"
        return "this goal does not hold the video; nothing to stop"

    def _on_revoked(self, revoked: guidance.Revoked) -> None:
        if self._holder.revoke(revoked.goal_id, revoked.token):
            self._stop()

    def _start(self, command: video.ControlVideo) -> str:
        assert self._bus is not None
        if self._stream is not None and self._stream.goal == command.goal_id:
            return "streaming"
        self._stop()
        self._holder.goal = command.goal_id
        self._stream = Stream(command.goal_id, command.min_fps, command.min_quality)
        bus = self._bus
        self._running = [
            bus.subscribe(video.CAMERA, stream_reader(video.CameraHeader, self._on_picture), latest_only=True),
            bus.subscribe(link.LINK_STATUS, message_reader(link.LinkStatus, self._on_link), latest_only=True),
            bus.subscribe(video.VIDEO_STATUS, message_reader(video.VideoStatus, self._on_report), latest_only=True),
            bus.every(RENEWAL, self._ask_for_pictures),
            bus.every(STATUS_PERIOD, self._publish_status),
        ]
        self._ask_for_pictures()
        return "streaming"

    def _stop(self) -> None:
        self._holder.goal, self._stream = None, None
        for handle in self._running:
            handle.cancel()
        self._running = []

    def _ask_for_pictures(self) -> None:
        assert self._bus is not None
        if self._stream is not None:
            wanted = video.ControlCamera(fps=self._stream.control.rates.fps, seconds=LEASE, tilt=self._tilt)
            self._bus.ask(video.CAMERA_COMMAND, encode(wanted), lambda answer: None)

    # --- pictures --------------------------------------------------------------------------------------------

    def _on_picture(self, header: video.CameraHeader, payload: bytes) -> None:
        stream = self._stream
        if stream is None or self._queued > CONGESTED:
            return
        picture = np.frombuffer(payload, np.uint8).reshape(header.height, header.width, 3)
        rates = stream.control.rates
        if stream.encoder is None:
            stream.encoder = Encoder(header.width, header.height, stream.control.slowest_fps)
        keyframe = stream.wants_keyframe and header.t - stream.keyframe_at >= KEYFRAME_PAUSE
        unit = stream.encoder.encode(picture, header.t, rates.bitrate, rates.fps, keyframe=keyframe)
        if unit is None:
            return
        if unit.keyframe:
            stream.keyframe_at, stream.wants_keyframe = header.t, False
        parity = stream.control.parity(len(unit.data))
        for packet, data in cut(unit, stream.goal, stream.frame, stream.sequence, header.t, parity=parity):
            self._sent.put(data, encode(packet))
            stream.sequence += 1
        stream.frame += 1

    def _on_link(self, status: link.LinkStatus) -> None:
        assert self._bus is not None
        self._queued = status.queued
        if self._stream is not None:
            self._stream.control.link(self._bus.now(), status)

    def _on_report(self, status: video.VideoStatus) -> None:
        assert self._bus is not None
        stream = self._stream
        if stream is None or status.stream != stream.goal:
            return
        if status.wants_keyframe and status.t > stream.keyframe_at:
            stream.wants_keyframe = True
        before = stream.control.rates.fps
        stream.control.report(self._bus.now(), status)
        if stream.control.rates.fps != before:
            self._ask_for_pictures()

    def _publish_status(self) -> None:
        assert self._bus is not None
        stream = self._stream
        if stream is not None:
            rates = stream.control.rates
            status = video.EncoderStatus(
                t=self._bus.now(),
                stream=stream.goal,
                bitrate=rates.bitrate,
                fps=rates.fps,
                changes=stream.control.changes,
            )
            self._status.put(encode(status))


def _require_possible(command: video.ControlVideo) -> None:
    """Raise CommandRefusedError for demands that no link can meet."""
    if not 0.0 < command.min_fps <= HIGHEST_FPS or not 0.0 <= command.min_quality <= 1.0:
        raise CommandRefusedError(
            ErrorCode.BAD_REQUEST,
            f"{command.min_fps:g} pictures a second of quality {command.min_quality:g} cannot be had",
            f"ask for up to {HIGHEST_FPS:g} a second, and a quality between 0 and 1",
        )


class VideoOptions(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Options of `make_video`: `tilt`, the angle of the camera below the body's x axis [rad]."""

    tilt: float = 0.0


def make_video(options: dict[str, Any]) -> VideoNode:
    """The video process. Raises OptionsError."""
    return VideoNode(read_options(options, VideoOptions).tilt)
