"""Receiver of a stream on the ground: decodable access units, and figures of the reception."""

from __future__ import annotations

import statistics
from collections import deque

from skillwing.onboard.topics.video import VideoPacket, VideoStatus
from skillwing.onboard.video.packets import Assembly, Received

WINDOW = 1.0
"""Time that the figures cover [s]."""


class VideoReceiver:
    """Packets in, whole decodable access units out; the stream of another goal resets it. Pure.

    A picture builds on the one before it. After a gap nothing is decodable before the next keyframe: the last picture
    stays on the screen, and the report requests a keyframe.
    """

    def __init__(self) -> None:
        self._begin("")

    def _begin(self, stream: str) -> None:
        self.stream = stream
        self.waiting = True
        """No picture is decodable before the next keyframe."""
        self._assembly = Assembly()
        self._next = -1
        self._packets: deque[tuple[float, int, int]] = deque()
        self._before = -1
        self._shown: deque[tuple[float, float]] = deque()
        self._quality: float | None = None

    def packet(self, t: float, header: VideoPacket, data: bytes) -> Received | None:
        """Take a packet that arrived at `t`; return the access unit to decode now, if it completes one."""
        if header.stream != self.stream:
            self._begin(header.stream)
            self._before = header.sequence - 1
        self._packets.append((t, header.sequence, len(data)))
        whole = self._assembly.add(header, data)
        if whole is None:
            return None
        if not whole.unit.keyframe and (self.waiting or whole.frame != self._next):
            self.waiting = True
            return None
        self.waiting, self._next = False, whole.frame + 1
        return whole

    def undecodable(self) -> None:
        """Note that the decoder refused the access unit."""
        self.waiting = True

    def shown(self, t: float, taken: float, quality: float | None) -> None:
        """Note that the picture `taken` then was shown at `t`, with its quality if that was measured."""
        self._shown.append((t, t - taken))
        if quality is not None:
            self._quality = quality

    def status(self, t: float) -> VideoStatus:
        """The report as of `t`."""
        while self._packets and self._packets[0][0] <= t - WINDOW:
            self._before = self._packets.popleft()[1]
        while self._shown and self._shown[0][0] <= t - WINDOW:
            self._shown.popleft()
        due = self._packets[-1][1] - self._before if self._packets else 0
        return VideoStatus(
            t=t,
            stream=self.stream,
            fps=len(self._shown) / WINDOW,
            quality=self._quality if self._shown else None,
            bitrate=8.0 * sum(size for _, _, size in self._packets) / WINDOW,
            lost=max(0.0, 1.0 - len(self._packets) / due) if due > 0 else 0.0,
            latency=statistics.median(delay for _, delay in self._shown) if self._shown else None,
            wants_keyframe=self.waiting,
        )
