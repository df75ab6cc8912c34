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
"""Clock rate of a picture's time stamp, as in RTP [Hz]."""
FASTEST_RATE, SLOWEST_RATE = 1_500_000, 40_000
"""Limits of the encoder's rate [bit/s]."""
RICH, RICHEST = 100_000, 250_000
"""Largest mean size of a picture, at high and at low frame rates [bit]. Larger ones hardly improve the camera's
pictures."""
_BUFFER = 0.75
"""Size of the encoder's rate buffer, in such pictures. With a smaller one pictures stay below their share; with a
larger one a collapsing link stays congested for longer."""
_NOMINAL_FPS = 15


@dataclass(frozen=True, slots=True)
class AccessUnit:
    """An encoded picture; a keyframe can be decoded without those before it."""

    data: bytes
    keyframe: bool


SMALLEST, LARGEST = 16, 4096
"""Limits of a picture's sides, which have to be even."""


class Encoder:
    """An encoder whose rate can be changed while it runs.

    libx264 follows a new rate within about half a second, without a keyframe. It has to be opened with constant rate,
    and no later rate may exceed the first. It assumes the frame rate that it was opened with. So its rate is not the
    bit rate of the stream, but sets the size of each picture.
    """

    def __init__(self, width: int, height: int, slowest_fps: float) -> None:
        """An encoder for up to the fastest rate, even at only `slowest_fps` pictures a second, within the useful sizes.

        Raises ValueError for a picture that is too small, too large, or odd.
        """
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
            # Keyframes only on request: each costs as much as several other pictures.
            "x264-params": "keyint=infinite:scenecut=0",
        }
        self._last = -1

    def encode(self, picture: Picture, t: float, bitrate: float, fps: float, *, keyframe: bool) -> AccessUnit | None:
        """Encode a picture (height, width, 3) taken at `t` [s], for a stream of `bitrate` [bit/s] and `fps`.

        The encoder's first rate limits the size. Returns None if the encoder skips the picture. Times have to grow; a
        repeated one is moved by a tick.
        """
        frame = av.VideoFrame.from_ndarray(picture, format="rgb24")
        if not self._codec.is_open:
            # A rate holds from the second picture on. The first one has the largest size and is not sent.
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
    """Bytes that are no access unit in sequence with those before."""


class Decoder:
    """Decoder of one access unit after the other."""

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
