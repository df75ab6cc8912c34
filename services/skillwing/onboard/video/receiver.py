"""The ground's side of a stream: what can be decoded, and how well it goes."""

from __future__ import annotations

import statistics
from collections import deque

from skillwing.onboard.topics.video import VideoPacket, VideoStatus
from skillwing.onboard.video.packets import Assembly, Received

WINDOW = 1.0
"""Figures are those of the last second."""


class Receiver:
    """Pieces in, whole decodable access units out; from one goal's stream to the next it begins anew. Pure.

    A picture builds on the one before it. After a gap nothing is decodable until a keyframe comes: what was shown last
    stays on the screen, and the report asks for one.
    """

    def __init__(self) -> None:
        self._begin("")

    def _begin(self, stream: str) -> None:
        self.stream = stream
        self.waiting = True
        """No picture can be decoded before the next keyframe."""
        self._assembly = Assembly()
        self._next = -1
        self._pieces: deque[tuple[float, int, int]] = deque()
        self._before = -1
        self._shown: deque[tuple[float, float]] = deque()
        self._quality: float | None = None

    def piece(self, t: float, header: VideoPacket, data: bytes) -> Received | None:
        """A piece arrived at `t`. The access unit that is to be decoded now, if this piece makes one."""
        if header.stream != self.stream:
            self._begin(header.stream)
            self._before = header.sequence - 1
        self._pieces.append((t, header.sequence, len(data)))
        whole = self._assembly.add(header, data)
        if whole is None:
            return None
        if not whole.unit.keyframe and (self.waiting or whole.frame != self._next):
            self.waiting = True
            return None
        self.waiting, self._next = False, whole.frame + 1
        return whole

    def undecodable(self) -> None:
        """The access unit was none after all."""
        self.waiting = True

    def shown(self, t: float, taken: float, quality: float | None) -> None:
        """At `t` the picture `taken` then was shown; its quality, where that was measured."""
        self._shown.append((t, t - taken))
        if quality is not None:
            self._quality = quality

    def status(self, t: float) -> VideoStatus:
        """The report as of `t`."""
        while self._pieces and self._pieces[0][0] <= t - WINDOW:
            self._before = self._pieces.popleft()[1]
        while self._shown and self._shown[0][0] <= t - WINDOW:
            self._shown.popleft()
        due = self._pieces[-1][1] - self._before if self._pieces else 0
        return VideoStatus(
            t=t,
            stream=self.stream,
            fps=len(self._shown) / WINDOW,
            quality=self._quality if self._shown else None,
            bitrate=8.0 * sum(size for _, _, size in self._pieces) / WINDOW,
            lost=max(0.0, 1.0 - len(self._pieces) / due) if due > 0 else 0.0,
            latency=statistics.median(delay for _, delay in self._shown) if self._shown else None,
            wants_keyframe=self.waiting,
        )
