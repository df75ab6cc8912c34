"""H.264 by libx264 and libavcodec, through PyAV: one access unit in, one picture out, nothing held back."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

import av
import av.error
import numpy as np
from av.video.codeccontext import VideoCodecContext
from av.video.frame import PictureType
from numpy.typing import NDArray

Picture = NDArray[np.uint8]
CLOCK = 90_000
"""Ticks a second of a picture's time stamp, as RTP has it."""
FASTEST_RATE, SLOWEST_RATE = 1_500_000, 40_000
"""Between them the encoder's rate can be chosen [bit/s]."""
RICH, RICHEST = 100_000, 250_000
"""What a picture can get on average [bit], where pictures are many and where they are few. With more, those of the
camera hardly become better."""
_BUFFER = 0.75
"""How far the encoder may be ahead of its rate, in such pictures. With less, pictures stay below what they may have;
with more, a link that collapses is clogged for longer."""
_NOMINAL_FPS = 15


@dataclass(frozen=True, slots=True)
class AccessUnit:
    """What a picture has become, and whether it can be decoded without those before it."""

    data: bytes
    keyframe: bool


SMALLEST, LARGEST = 16, 4096
"""Sides of a picture that can be encoded; they have to be even."""


class Encoder:
    """An encoder whose rate can be changed while it runs.

    libx264 follows a new rate within about half a second, without a keyframe, as long as it was opened as one of
    constant rate, and none faster than the first is asked for. It takes pictures to be as far apart as it was told when
    it was opened; so what it is told is not the bit rate, but what each picture is to get.
    """

    def __init__(self, width: int, height: int, slowest_fps: float) -> None:
        """An encoder that gives pictures the fastest rate's share, be they as few as `slowest_fps` a second, as far as
        they have any use for it. Raises ValueError for a picture that is too small, too large, or odd."""
        if any(not SMALLEST <= side <= LARGEST or side % 2 for side in (width, height)):
            raise ValueError(f"pictures of {width} x {height} pixels cannot be encoded")
        self._codec = av.CodecContext.create("libx264", "w")
        assert isinstance(self._codec, VideoCodecContext)
        self._codec.width, self._codec.height, self._codec.pix_fmt = width, height, "yuv420p"
        self._codec.time_base = Fraction(1, CLOCK)
        self._codec.framerate = Fraction(_NOMINAL_FPS)
        self._richest = round(min(max(FASTEST_RATE / slowest_fps, RICH), RICHEST))
        self._codec.bit_rate = self._richest * _NOMINAL_FPS
        self._codec.thread_count = 1
        self._codec.options = {
            "preset": "veryfast",
            "tune": "zerolatency",
            "maxrate": str(self._richest * _NOMINAL_FPS),
            "bufsize": str(round(self._richest * _BUFFER)),
            # Keyframes come on request only: each costs as much as several other pictures.
            "x264-params": "keyint=infinite:scenecut=0",
        }
        self._last = -1

    def encode(self, picture: Picture, t: float, bitrate: float, fps: float, *, keyframe: bool) -> AccessUnit | None:
        """Encode a picture (height, width, 3) taken at `t` [s], aiming at `bitrate` [bit/s] from now on, of which each
        of `fps` pictures a second gets its share, as long as that is no more than what it was opened for.

        None where the encoder leaves a picture out. Times have to grow; a repeated one is moved by a tick.
        """
        frame = av.VideoFrame.from_ndarray(picture, format="rgb24")
        if not self._codec.is_open:
            # A rate counts from the second picture on. The first one nobody gets: it is as rich as any can be.
            self._packets(frame, t, keyframe=True)
            keyframe = True
        self._codec.bit_rate = round(min(max(bitrate, SLOWEST_RATE) / fps, self._richest) * _NOMINAL_FPS)
        packets = self._packets(frame, t, keyframe=keyframe)
        if not packets:
            return None
        return AccessUnit(b"".join(bytes(packet) for packet in packets), any(packet.is_keyframe for packet in packets))

    def _packets(self, frame: av.VideoFrame, t: float, *, keyframe: bool) -> list[av.Packet]:
        frame.pts = self._last = max(self._last + 1, round(t * CLOCK))
        frame.time_base = Fraction(1, CLOCK)
        frame.pict_type = PictureType.I if keyframe else PictureType.NONE
        return self._codec.encode(frame)


class UndecodableError(ValueError):
    """These bytes are no access unit that fits those before it."""


class Decoder:
    """Decodes one access unit after the other."""

    def __init__(self) -> None:
        self._codec = av.CodecContext.create("h264", "r")
        assert isinstance(self._codec, VideoCodecContext)
        self._codec.thread_count = 1

    def decode(self, data: bytes) -> Picture:
        """The picture (height, width, 3). Raises UndecodableError."""
        if not data:
            raise UndecodableError("there is nothing in it")  # to the codec that would be the end of the stream
        try:
            frames = self._codec.decode(av.Packet(data))
        except av.error.FFmpegError as error:
            raise UndecodableError(str(error)) from error
        if not frames:
            raise UndecodableError("there is no picture in it")
        return np.asarray(frames[-1].to_ndarray(format="rgb24"), dtype=np.uint8)


def jpeg(picture: Picture) -> bytes:
    """A picture (height, width, 3) as a JPEG file."""
    codec = av.CodecContext.create("mjpeg", "w")
    assert isinstance(codec, VideoCodecContext)
    codec.height, codec.width = picture.shape[:2]
    codec.pix_fmt, codec.time_base = "yuvj420p", Fraction(1, CLOCK)
    codec.qmin = codec.qmax = 5
    packets = codec.encode(av.VideoFrame.from_ndarray(picture, format="rgb24"))
    return b"".join(bytes(packet) for packet in (*packets, *codec.encode(None)))
