"""The ground station as a process: decodes the video from the link, measures it, and reports back over the link.

The quality is a full-reference measure, which only a simulation can have. This process also subscribes to the camera
itself, and compares each picture with its original. A real ground station would have to estimate the quality.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from skillwing.onboard.topics import video
from skillwing.onboard.video.codec import Decoder, Picture, UndecodableError, jpeg
from skillwing.onboard.video.packets import Received
from skillwing.onboard.video.receiver import VideoReceiver
from skillwing.onboard.video.similarity import similarity
from skillwing.services.bus import Bus, Handle
from skillwing.services.bus.reading import stream_reader
from skillwing.services.options import OptionsError
from skillwing.services.protocol import encode

REPORT_PERIOD, QUALITY_PERIOD, PICTURE_PERIOD = 0.25, 0.2, 0.25
SILENCE = 3.0
"""Time without a packet after which the stream is over, and reports end [s]."""
REMEMBERED = 60
"""Number of originals kept; the quality of a picture that arrives later is not measured."""


class GroundNode:
    """Shell around a `VideoReceiver` and a `Decoder`. Without a stream it only listens."""

    name = "ground"
    owns_clock = False

    def __init__(self) -> None:
        self._receiver = VideoReceiver()
        self._decoder: Decoder | None = None
        self._originals: dict[float, tuple[tuple[int, int, int], bytes]] = {}
        self._heard_at = self._measured_at = self._drawn_at = float("-inf")
        self._reporting: Handle | None = None
        self._bus: Bus | None = None

    def attach(self, bus: Bus) -> None:
        self._bus = bus
        self._report = bus.advertise(video.VIDEO_REPORT)
        self._screen = bus.advertise(video.VIDEO_SHOWN)
        bus.subscribe(video.CAMERA, stream_reader(video.CameraHeader, self._on_original))
        bus.subscribe(video.VIDEO_RECEIVED, stream_reader(video.VideoPacket, self._on_packet))

    def detach(self) -> None:
        """Do nothing: the drone detects the end of reports by itself."""

    def _on_original(self, header: video.CameraHeader, payload: bytes) -> None:
        self._originals[header.t] = (header.height, header.width, 3), payload
        if len(self._originals) > REMEMBERED:
            del self._originals[next(iter(self._originals))]

    def _on_packet(self, header: video.VideoPacket, data: bytes) -> None:
        assert self._bus is not None
        now = self._heard_at = self._bus.now()
        if self._reporting is None:
            self._reporting = self._bus.every(REPORT_PERIOD, self._publish_report)
        is_new = header.stream != self._receiver.stream
        waited = self._receiver.waiting
        whole = self._receiver.packet(now, header, data)
        if is_new or self._decoder is None:
            self._decoder = Decoder()
        if whole is not None:
            self._show(now, whole, self._decoder)
        if self._receiver.waiting and not waited and not is_new:
            # Request a keyframe at once.
            self._publish_report()

    def _show(self, now: float, whole: Received, decoder: Decoder) -> None:
        try:
            picture = decoder.decode(whole.unit.data)
        except UndecodableError:
            self._receiver.undecodable()
            return
        self._receiver.shown(now, whole.t, self._quality(now, whole.t, picture))
        if now - self._drawn_at >= PICTURE_PERIOD:
            self._drawn_at = now
            height, width = picture.shape[:2]
            self._screen.put(jpeg(picture), encode(video.VideoShown(t=whole.t, width=width, height=height)))

    def _quality(self, now: float, taken: float, picture: Picture) -> float | None:
        original = self._originals.get(taken)
        if original is None or now - self._measured_at < QUALITY_PERIOD:
            return None
        shape, payload = original
        if shape != picture.shape or len(payload) != picture.size:
            return None
        self._measured_at = now
        return similarity(np.frombuffer(payload, np.uint8).reshape(shape), picture)

    def _publish_report(self) -> None:
        assert self._bus is not None
        now = self._bus.now()
        if now - self._heard_at > SILENCE and self._reporting is not None:
            self._reporting.cancel()
            self._reporting, self._decoder = None, None
            self._receiver = VideoReceiver()
            self._originals.clear()
            return
        self._report.put(encode(self._receiver.status(now)))


def make_ground(options: dict[str, Any]) -> GroundNode:
    """The ground station; it takes no options. Raises OptionsError if there are any."""
    if options:
        raise OptionsError(f"the ground station takes no options; remove {', '.join(sorted(options))}")
    return GroundNode()
