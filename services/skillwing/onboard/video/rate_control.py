"""Rate control: bit rate, frame rate and parity that fit the link and meet both demands, with few changes.

The bit rate follows the link: down at once, because packets that do not fit only wait; up step by step, once there has
been room for some time. The frame rate follows the quality. If that is too low at the present bit rate, fewer pictures
get more bits each, down to the demanded frame rate. Parity follows the loss that the modem reports. If too few pictures
arrive all the same, the controller assumes more loss than reported.

A failed attempt to take such a step back doubles the wait before the next one. So on a constant link the rates settle.
A different link ends the long wait, and so does a step back that has held as far as others failed.
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
"""Factor on the demanded frame rate, because some pictures are late or lost."""
ENOUGH_FPS, NEARLY_ALL = 1.1, 0.95
"""Limits for too few pictures: factor on the demanded frame rate, and share of the sent frame rate."""
SHARE = 0.75
"""Share of the bandwidth for the stream, because sizes of pictures vary and keyframes are large."""
PICTURE_COST = 8.0 * 120
"""Overhead of a picture: headers of about two packets [bit]."""
PARITY_COST = 8.0 * 60
"""Overhead of a parity packet [bit]."""
STEP = 1.2
"""Ratio of neighbouring bit rates."""
ROOM = 1.1
"""Ratio of the bandwidth to that of the next bit rate before it is chosen."""
PATIENCE, PICTURE_PATIENCE, RETRY = 2.0, 2.0, 4.0
"""Time with room before the bit rate rises; time after a change before reports count; time of good pictures before a
step back [s]."""
BEGINNING = 1.0
"""Additional time at the start of a stream: the ground counts pictures over a second [s]."""
HELD = 60.0
"""Time without failure, at least as long as the wait before, after which a step back is final [s]."""
ANOTHER, ANOTHER_AIR = 1.5, 2.0
"""Factors on bandwidth and on loss from which the link counts as a different one, for which old trials do not count."""
TOO_POOR, GOOD_ENOUGH = 0.02, 0.05
"""Margins on the demanded quality: below the first the frame rate falls, above the second it may rise."""
WARIER, WARIEST = 2.0, 3
"""Factor on the reported loss for each step of caution, and number of steps."""
_SMOOTHING = 1.5
_LEVELS = 1 + math.floor(math.log(FASTEST_RATE / SLOWEST_RATE, STEP))


@dataclass(frozen=True, slots=True)
class Rates:
    """Rates for the encoder: [bit/s] and pictures a second."""

    bitrate: float
    fps: float


class Concession:
    """Steps away from the preferred value, at most `last`. They are taken when necessary, and taken back after a time
    of good reports. Pure."""

    def __init__(self, last: int) -> None:
        self._last = last
        self.steps = 0
        self._well_since: float | None = None
        self.forget_trials()

    @property
    def can_grow(self) -> bool:
        return self.steps < self._last

    def grow(self) -> None:
        """Take a step; if a step back was on trial, the next trial waits longer."""
        if self._tried_at is not None:
            self._retry *= 2.0
            self._failed_at = min(self._failed_at, self.steps)
        self.steps, self._tried_at, self._well_since = self.steps + 1, None, None

    def forget_trials(self) -> None:
        """Make the step back on trial final, and reset the wait for the next one."""
        self._retry, self._failed_at = RETRY, self._last
        self._tried_at: float | None = None

    def observe(self, t: float, *, well: bool) -> bool:
        """Take a step back if it is time; return True if so."""
        if self._tried_at is not None and t - self._tried_at >= max(HELD, self._retry):
            self._tried_at = None
            # A first step back that holds says nothing about a second one that failed: the next attempt still waits.
            if self.steps <= self._failed_at:
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
    """A smoothed figure. Pure."""

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
        self._reported_loss, self._dropped, self._crowded_at = 0.0, 0, -math.inf
        self._chosen_at = -math.inf
        self._forget()
        self.changes = 0
        """Number of changes of rates or caution."""

    @property
    def rates(self) -> Rates:
        """The present rates."""
        return Rates(_bitrate(self._level or 0), self._fps[self._slower.steps])

    @property
    def slowest_fps(self) -> float:
        """The lowest frame rate that may ever be chosen."""
        return self._fps[-1]

    def parity(self, size: int) -> int:
        """Number of parity packets for a picture of `size` bytes."""
        return parity_against(self._loss, parts_of(size))

    def link(self, t: float, status: LinkStatus) -> None:
        """Take the modem's status at `t`."""
        if status.dropped != self._dropped:
            self._dropped, self._crowded_at = status.dropped, t
        loss = max(status.loss, LOSSY)
        if _differ(status.bandwidth, self._tried_on, ANOTHER) or _differ(loss, self._tried_in, ANOTHER_AIR):
            self._tried_on, self._tried_in = status.bandwidth, loss
            self._slower.forget_trials()
            self._warier.forget_trials()
        self._reported_loss = status.loss
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
            # Half of the way at once: far below the link's capacity there is no risk.
            self._level += max(1, (roomy - self._level) // 2)
            self.changes += 1
            self._roomy_since = t

    def report(self, t: float, status: VideoStatus) -> None:
        """Take the ground's report at `t`."""
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
        """Share of lost packets to plan for."""
        steps = self._warier.steps
        return max(self._reported_loss, LOSSY) * WARIER**steps if steps else self._reported_loss

    def _loses_pictures(self, t: float, status: VideoStatus) -> bool:
        """Test for loss in the channel. Parity would not help against the modem's full queue."""
        return t - self._crowded_at >= PATIENCE and max(self._reported_loss, status.lost) > LOSSY

    def _level_within(self, budget: float, highest: int) -> int:
        """The fastest bit rate, at most the `highest`, that leaves room for headers and parity; else the slowest."""
        level = min(highest, _level(budget))
        while level > 0 and self._cost(_bitrate(level)) > budget:
            level -= 1
        return level

    def _cost(self, bitrate: float) -> float:
        """Bandwidth for pictures of this bit rate [bit/s]."""
        fps = self.rates.fps
        size = math.ceil(bitrate / fps / 8.0)
        parity = self.parity(size)
        return bitrate * (1.0 + parity / parts_of(size)) + (PICTURE_COST + PARITY_COST * parity) * fps

    def _forget(self) -> None:
        """Discard smoothed figures of earlier rates."""
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
