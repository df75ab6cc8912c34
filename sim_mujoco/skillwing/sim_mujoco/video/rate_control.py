"""How much to send: bit rate and frame rate that fit the link, changed as seldom as possible.

The bit rate follows the link: down at once, because what does not fit only waits, and up step by step once there has
been room for some time. The frame rate follows the picture: where it is not good enough at the bit rate there is, fewer
pictures get more bits each, down to the frame rate that is needed at least. Every attempt to go back up that fails
makes the next one wait twice as long, so that a link that stays as it is finds its rates and keeps them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from skillwing.sim_mujoco.topics import LinkStatus, VideoStatus
from skillwing.sim_mujoco.video.codec import FASTEST_RATE, SLOWEST_RATE
from skillwing.sim_mujoco.video.pieces import LARGEST

USUAL_FPS, HIGHEST_FPS = 15.0, 30.0
SPARE_FPS = 1.2
"""More pictures than needed at least: some are late or lost."""
SHARE = 0.75
"""Of the bandwidth that the stream takes: pictures are not all of one size, and keyframes have to get through."""
PICTURE_COST = 8.0 * 120
"""What a picture costs beside its bits: headers, about two packets [bit]."""
LOSSY = 0.005
"""Above this share of lost packets pictures are protected."""
STEP = 1.2
"""Between two bit rates."""
ROOM = 1.1
"""So much more than the next bit rate there has to be before it is taken."""
PATIENCE, PICTURE_PATIENCE, RETRY = 2.0, 2.0, 4.0
"""How long there has to be room before the bit rate is raised, how long a frame rate is given before its picture is
judged, and how long the picture has to be good enough for more before that is tried [s]."""
TOO_POOR, GOOD_ENOUGH = 0.02, 0.05
"""Above the quality that is needed: below the first the frame rate falls, above the second it may rise."""
_SMOOTHING = 1.5
_LEVELS = 1 + math.floor(math.log(FASTEST_RATE / SLOWEST_RATE, STEP))


@dataclass(frozen=True, slots=True)
class Rates:
    """What the encoder is to aim at: [bit/s] and pictures a second."""

    bitrate: float
    fps: float


class RateController:
    """Rates for one stream. Pure; times must not run backwards."""

    def __init__(self, min_fps: float, min_quality: float) -> None:
        highest = min(HIGHEST_FPS, max(USUAL_FPS, SPARE_FPS * min_fps))
        lowest = min(highest, SPARE_FPS * min_fps)
        steps = math.ceil(math.log(highest / lowest) / math.log(4 / 3))
        self._fps = [highest * (lowest / highest) ** (k / steps) for k in range(steps + 1)] if steps else [highest]
        self._min_quality = min_quality
        self._level: int | None = None
        self._slower = 0
        self._roomy_since: float | None = None
        self._quality: tuple[float, float] | None = None
        self._fps_since = -math.inf
        self._good_since: float | None = None
        self._retry, self._tried = RETRY, False
        self.protects = False
        """Whether every picture goes with a parity piece, because the air swallows packets."""
        self.changes = 0
        """How often the rates have changed."""

    @property
    def rates(self) -> Rates:
        """What holds now."""
        return Rates(SLOWEST_RATE * STEP ** (self._level or 0), self._fps[self._slower])

    def link(self, t: float, status: LinkStatus) -> None:
        """What the modem says at `t`."""
        self.protects = status.loss > LOSSY
        budget = self._for_pictures(SHARE * status.bandwidth * (1.0 - status.loss))
        fits = _level(budget)
        if self._level is None:
            self._level, self._fps_since = fits, t
        elif fits < self._level:
            self._change(level=fits)
            self._roomy_since = None
        elif _level(budget / ROOM) <= self._level:
            self._roomy_since = None
        elif self._roomy_since is None:
            self._roomy_since = t
        elif t - self._roomy_since >= PATIENCE:
            # Half of the way at once: far below what the link can do there is no need to be careful.
            self._change(level=self._level + max(1, (_level(budget / ROOM) - self._level) // 2))
            self._roomy_since = t

    def report(self, t: float, status: VideoStatus) -> None:
        """What the ground says, heard at `t`."""
        if status.quality is None or t - self._fps_since < PICTURE_PATIENCE / 2:
            return
        quality = self._smoothed(t, status.quality)
        if t - self._fps_since < PICTURE_PATIENCE:
            return
        if quality < self._min_quality + TOO_POOR:
            self._good_since = None
            if self._slower < len(self._fps) - 1:
                if self._tried:
                    self._retry *= 2.0
                self._choose_fps(t, self._slower + 1, tried=False)
        elif quality < self._min_quality + GOOD_ENOUGH or self._slower == 0:
            self._good_since = None
        elif self._good_since is None:
            self._good_since = t
        elif t - self._good_since >= self._retry:
            self._choose_fps(t, self._slower - 1, tried=True)

    def _for_pictures(self, bitrate: float) -> float:
        """What is left of a bit rate after headers, and after parity: as large as a picture, but at most one piece."""
        fps = self.rates.fps
        left = bitrate - PICTURE_COST * fps
        return max(left / 2.0, left - 8.0 * LARGEST * fps) if self.protects else left

    def _choose_fps(self, t: float, slower: int, *, tried: bool) -> None:
        self._change(slower=slower)
        self._fps_since, self._tried = t, tried
        self._quality = self._good_since = None

    def _change(self, *, level: int | None = None, slower: int | None = None) -> None:
        self._level = self._level if level is None else level
        self._slower = self._slower if slower is None else slower
        self.changes += 1

    def _smoothed(self, t: float, quality: float) -> float:
        if self._quality is None:
            self._quality = t, quality
            return quality
        before, value = self._quality
        value += (1.0 - math.exp(-(t - before) / _SMOOTHING)) * (quality - value)
        self._quality = t, value
        return value


def _level(budget: float) -> int:
    """The fastest bit rate that fits the budget [bit/s]; the slowest one if none does."""
    if budget <= SLOWEST_RATE:
        return 0
    # A modem may tell of any number, of more than there are as well.
    return _LEVELS - 1 if math.isinf(budget) else min(_LEVELS - 1, math.floor(math.log(budget / SLOWEST_RATE, STEP)))
