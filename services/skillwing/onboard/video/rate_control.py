"""How much to send, and how well protected: what fits the link and holds both demands, changed as seldom as possible.

The bit rate follows the link: down at once, because what does not fit only waits, and up step by step once there has
been room for some time. The frame rate follows the picture: where it is not good enough at the bit rate there is, fewer
pictures get more bits each, down to the frame rate that is needed at least. Protection follows what the modem says of
lost packets; where too few pictures get through all the same, more is assumed to be lost than it says. Every attempt to
take such a step back that fails makes the next one wait twice as long, so that a link that stays as it is finds its
rates and keeps them. One that has held, or a link that has become another, ends the long waiting.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from skillwing.onboard.topics.link import LinkStatus
from skillwing.onboard.topics.video import VideoStatus
from skillwing.onboard.video.codec import FASTEST_RATE, SLOWEST_RATE
from skillwing.onboard.video.erasure import LOSSY, parity_against
from skillwing.onboard.video.packets import parts_of

USUAL_FPS, HIGHEST_FPS = 15.0, 30.0
SPARE_FPS = 1.2
"""More pictures than needed at least: some are late or lost."""
ENOUGH_FPS, NEARLY_ALL = 1.1, 0.95
"""Too few get through if it is less than this times what is needed, and less than this share of what is sent."""
SHARE = 0.75
"""Of the bandwidth that the stream takes: pictures are not all of one size, and keyframes have to get through."""
PICTURE_COST = 8.0 * 120
"""What a picture costs beside its bits: headers, about two packets [bit]."""
PARITY_COST = 8.0 * 60
"""What a parity piece costs beside its bits [bit]."""
STEP = 1.2
"""Between two bit rates."""
ROOM = 1.1
"""So much more than the next bit rate there has to be before it is taken."""
PATIENCE, PICTURE_PATIENCE, RETRY = 2.0, 2.0, 4.0
"""How long there has to be room before the bit rate is raised, how long what was chosen is given before pictures are
judged, and how long they have to be good enough for more before that is tried [s]."""
BEGINNING = 1.0
"""So much longer has what a stream begins with: the ground counts pictures over a second [s]."""
HELD = 60.0
"""An attempt that has not failed for so long, and for as long as it had been waited for, never will [s]."""
ANOTHER, ANOTHER_AIR = 1.5, 2.0
"""A link of so many times the bandwidth, or the loss, is another, as is one of that part of it: what failed on one may
do on the other."""
TOO_POOR, GOOD_ENOUGH = 0.02, 0.05
"""Above the quality that is needed: below the first the frame rate falls, above the second it may rise."""
WARIER, WARIEST = 2.0, 3
"""A step of caution takes the air for so many times as bad as the modem says; there are so many steps."""
_SMOOTHING = 1.5
_LEVELS = 1 + math.floor(math.log(FASTEST_RATE / SLOWEST_RATE, STEP))


@dataclass(frozen=True, slots=True)
class Rates:
    """What the encoder is to aim at: [bit/s] and pictures a second."""

    bitrate: float
    fps: float


class Concession:
    """Steps away from what is wanted, to `last` at most: taken when they must be, taken back when things have been well
    for some time. Pure."""

    def __init__(self, last: int) -> None:
        self._last = last
        self.steps = 0
        self._well_since: float | None = None
        self.forget_trials()

    @property
    def can_grow(self) -> bool:
        return self.steps < self._last

    def grow(self) -> None:
        """One step more; if there was one less on trial, the next trial waits longer."""
        if self._tried_at is not None:
            self._retry *= 2.0
        self.steps, self._tried_at, self._well_since = self.steps + 1, None, None

    def forget_trials(self) -> None:
        """The step on trial, if there is one, is for good, and the next one waits no longer than the first."""
        self._retry = RETRY
        self._tried_at: float | None = None

    def observe(self, t: float, *, well: bool) -> bool:
        """Whether a step may be taken back now; then it is."""
        if self._tried_at is not None and t - self._tried_at >= max(HELD, self._retry):
            self.forget_trials()
        if not well or self.steps == 0:
            self._well_since = None
        elif self._well_since is None:
            self._well_since = t
        elif t - self._well_since >= self._retry:
            self.steps, self._tried_at, self._well_since = self.steps - 1, t, None
            return True
        return False


class Smoothed:
    """A figure without its jitter. Pure."""

    def __init__(self) -> None:
        self._last: tuple[float, float] | None = None

    def __call__(self, t: float, value: float) -> float:
        if self._last is not None:
            before, mean = self._last
            value = mean + (1.0 - math.exp(-(t - before) / _SMOOTHING)) * (value - mean)
        self._last = t, value
        return value


class RateController:
    """Rates and protection for one stream. Pure; times must not run backwards."""

    def __init__(self, min_fps: float, min_quality: float) -> None:
        highest = min(HIGHEST_FPS, max(USUAL_FPS, SPARE_FPS * min_fps))
        lowest = min(highest, SPARE_FPS * min_fps)
        steps = math.ceil(math.log(highest / lowest) / math.log(4 / 3))
        self._fps = [highest * (lowest / highest) ** (k / steps) for k in range(steps + 1)] if steps else [highest]
        self._min_fps, self._min_quality = min_fps, min_quality
        self._level: int | None = None
        self._slower, self._warier = Concession(len(self._fps) - 1), Concession(WARIEST)
        self._roomy_since: float | None = None
        self._tried_on = self._tried_in = 0.0
        self._told_loss, self._dropped, self._crowded_at = 0.0, 0, -math.inf
        self._chosen_at = -math.inf
        self._forget()
        self.changes = 0
        """How often rates or caution have changed."""

    @property
    def rates(self) -> Rates:
        """What holds now."""
        return Rates(_bitrate(self._level or 0), self._fps[self._slower.steps])

    @property
    def slowest_fps(self) -> float:
        """The lowest frame rate that may ever be chosen."""
        return self._fps[-1]

    def parity(self, size: int) -> int:
        """How many parity pieces a picture of so many bytes is to have."""
        return parity_against(self._loss, parts_of(size))

    def link(self, t: float, status: LinkStatus) -> None:
        """What the modem says at `t`."""
        if status.dropped != self._dropped:
            self._dropped, self._crowded_at = status.dropped, t
        loss = max(status.loss, LOSSY)
        if _differ(status.bandwidth, self._tried_on, ANOTHER) or _differ(loss, self._tried_in, ANOTHER_AIR):
            self._tried_on, self._tried_in = status.bandwidth, loss
            self._slower.forget_trials()
            self._warier.forget_trials()
        self._told_loss = status.loss
        budget = SHARE * status.bandwidth
        fits = self._level_within(budget, _LEVELS - 1)
        if self._level is None:
            self._level, self._chosen_at = fits, t + BEGINNING
        elif fits < self._level:
            self._level = fits
            self.changes += 1
            self._roomy_since = None
        elif (roomy := self._level_within(budget / ROOM, fits)) <= self._level:
            self._roomy_since = None
        elif self._roomy_since is None:
            self._roomy_since = t
        elif t - self._roomy_since >= PATIENCE:
            # Half of the way at once: far below what the link can do there is no need to be careful.
            self._level += max(1, (roomy - self._level) // 2)
            self.changes += 1
            self._roomy_since = t

    def report(self, t: float, status: VideoStatus) -> None:
        """What the ground says, heard at `t`."""
        if t - self._chosen_at < PICTURE_PATIENCE / 2:
            return
        fps = self._seen_fps(t, status.fps)
        quality = None if status.quality is None else self._seen_quality(t, status.quality)
        if t - self._chosen_at < PICTURE_PATIENCE:
            return
        few = self._loses_pictures(t, status) and fps < min(ENOUGH_FPS * self._min_fps, NEARLY_ALL * self.rates.fps)
        poor = quality is not None and quality < self._min_quality + TOO_POOR
        good = quality is not None and quality >= self._min_quality + GOOD_ENOUGH
        if poor and self._slower.can_grow:
            self._slower.grow()
        elif few and not poor and self._warier.can_grow:
            self._warier.grow()
        elif not self._slower.observe(t, well=good) and not self._warier.observe(t, well=not few):
            return
        self.changes += 1
        self._chosen_at = t
        self._forget()

    @property
    def _loss(self) -> float:
        """The share of packets to be prepared for."""
        steps = self._warier.steps
        return max(self._told_loss, LOSSY) * WARIER**steps if steps else self._told_loss

    def _loses_pictures(self, t: float, status: VideoStatus) -> bool:
        """Whether the air swallows packets. What the modem had no room for parity would only make more."""
        return t - self._crowded_at >= PATIENCE and max(self._told_loss, status.lost) > LOSSY

    def _level_within(self, budget: float, highest: int) -> int:
        """The fastest bit rate, at most the `highest`, that leaves room for headers and parity; else the slowest."""
        level = min(highest, _level(budget))
        while level > 0 and self._cost(_bitrate(level)) > budget:
            level -= 1
        return level

    def _cost(self, bitrate: float) -> float:
        """What pictures of this bit rate take of the link [bit/s]."""
        fps = self.rates.fps
        size = math.ceil(bitrate / fps / 8.0)
        parity = self.parity(size)
        return bitrate * (1.0 + parity / parts_of(size)) + (PICTURE_COST + PARITY_COST * parity) * fps

    def _forget(self) -> None:
        """What was seen until now says nothing of what holds from now on."""
        self._seen_fps, self._seen_quality = Smoothed(), Smoothed()


def _differ(one: float, other: float, times: float) -> bool:
    less, more = sorted((one, other))
    return more > times * less


def _bitrate(level: int) -> float:
    return SLOWEST_RATE * STEP**level


def _level(budget: float) -> int:
    """The fastest bit rate that fits the budget [bit/s], without anything else; the slowest one if none does."""
    if budget <= SLOWEST_RATE:
        return 0
    return min(_LEVELS - 1, math.floor(math.log(budget / SLOWEST_RATE, STEP)))
