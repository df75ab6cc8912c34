"""The rate controller against a model of a codec: it settles, recovers, and gives up nothing that could be kept."""

from __future__ import annotations

import math

from hypothesis import given, settings
from hypothesis import strategies as st

from skillwing.m600.skills.shortfall import Shortfall
from skillwing.sim_mujoco.topics import LinkStatus, VideoStatus
from skillwing.sim_mujoco.video.codec import FASTEST_RATE
from skillwing.sim_mujoco.video.rate_control import (
    HIGHEST_FPS,
    PICTURE_COST,
    SHARE,
    SLOWEST_RATE,
    STEP,
    RateController,
    Rates,
)

min_fps = st.floats(1.0, 25.0)
min_quality = st.floats(0.0, 0.97)
difficulty = st.floats(0.3, 3.0)
ATTEMPTS = 2 * math.log2(600.0 / 4.0)
"""Changes of a settled loop in ten minutes: attempts at a higher frame rate and their revocations, ever more seldom."""


def link(t: float, bandwidth: float) -> LinkStatus:
    return LinkStatus(t=t, bandwidth=bandwidth, latency=0.03, loss=0.0, queued=0.0, sent=0.0, dropped=0)


def quality(rates: Rates, difficulty: float) -> float:
    """SSIM of a picture with so many bits: what libx264 gave for the inspection flight, roughly."""
    bits = rates.bitrate / rates.fps
    return 1.0 - min(1.0, 0.22 * difficulty * (3300.0 / bits) ** 0.55)


class Loop:
    """A controller between a link and a ground that sees what the model says."""

    def __init__(self, min_fps: float, min_quality: float, difficulty: float) -> None:
        self.control = RateController(min_fps, min_quality)
        self.difficulty = difficulty
        self.t = 0.0

    def run(self, seconds: float, bandwidth: float, wobble: float = 0.0) -> None:
        for _ in range(round(seconds / 0.25)):
            self.t += 0.25
            noise = wobble * math.sin(7.3 * self.t)
            self.control.link(self.t, link(self.t, bandwidth * (1.0 + noise)))
            self.control.report(self.t, self.seen(noise))

    def seen(self, noise: float = 0.0) -> VideoStatus:
        rates = self.control.rates
        seen = min(1.0, max(0.0, quality(rates, self.difficulty) + 0.1 * noise))
        return VideoStatus(
            t=self.t, stream="", fps=rates.fps, quality=seen, bitrate=rates.bitrate, lost=0.0, latency=0.05
        )


@settings(max_examples=60)
@given(min_fps, min_quality, difficulty, st.floats(2e4, 5e6))
def test_on_a_constant_link_the_rates_settle(fps: float, wanted: float, hard: float, bandwidth: float) -> None:
    loop = Loop(fps, wanted, hard)
    loop.run(60.0, bandwidth, wobble=0.03)
    settled = loop.control.changes
    assert settled <= 16
    loop.run(600.0, bandwidth, wobble=0.03)
    assert loop.control.changes - settled <= ATTEMPTS


def test_attempts_that_fail_become_rare() -> None:
    """Where one frame rate is too high for the picture and the next one is more than good enough."""
    changes: list[int] = []
    for bandwidth in range(60_000, 200_000, 5_000):
        loop = Loop(3.0, 0.5, 2.0)
        loop.run(60.0, bandwidth)
        settled = loop.control.changes
        loop.run(600.0, bandwidth)
        changes.append(loop.control.changes - settled)
    assert 4 <= max(changes) <= ATTEMPTS


@settings(max_examples=60)
@given(min_fps, min_quality, difficulty, st.lists(st.floats(1e4, 5e6), min_size=1, max_size=6))
def test_it_never_sends_more_than_fits_nor_fewer_pictures_than_needed(
    fps: float, wanted: float, hard: float, bandwidths: list[float]
) -> None:
    loop = Loop(fps, wanted, hard)
    for bandwidth in bandwidths:
        loop.run(5.0, bandwidth)
        rates = loop.control.rates
        cost = rates.bitrate + PICTURE_COST * rates.fps
        slowest = SLOWEST_RATE * (1 + 1e-9)
        # The frame rate may have risen since the link was looked at last.
        assert rates.bitrate <= slowest or cost <= SHARE * bandwidth + PICTURE_COST * HIGHEST_FPS
        assert min(fps, HIGHEST_FPS) <= rates.fps <= HIGHEST_FPS


@settings(max_examples=60)
@given(min_fps, st.floats(0.3, 0.9), difficulty, st.floats(1.5e5, 1e6))
def test_what_can_be_kept_is_kept(fps: float, wanted: float, hard: float, bandwidth: float) -> None:
    """If the lowest frame rate gives good pictures at the rate the link allows, good pictures are what comes out."""
    loop = Loop(fps, wanted, hard)
    loop.run(90.0, bandwidth)
    lowest = min(HIGHEST_FPS, 1.2 * fps)
    affordable = max(SLOWEST_RATE, (SHARE * bandwidth - PICTURE_COST * HIGHEST_FPS) / STEP**2)
    if quality(Rates(affordable, lowest), hard) >= wanted + 0.05:
        shortfall, start = Shortfall(loop.t), loop.t
        while loop.t < start + 60.0:
            loop.run(0.25, bandwidth)
            shortfall.observe(loop.t, good=(loop.seen().quality or 0.0) >= wanted)
            assert shortfall.total < 4.0


@settings(max_examples=40)
@given(st.floats(1.0, 12.0), st.floats(0.3, 0.9), difficulty, st.floats(2e4, 1e5))
def test_a_link_that_widens_again_is_used_again(fps: float, wanted: float, hard: float, narrow: float) -> None:
    never_narrow, narrowed = Loop(fps, wanted, hard), Loop(fps, wanted, hard)
    never_narrow.run(120.0, 3e6)
    narrowed.run(30.0, 3e6)
    narrowed.run(20.0, narrow)
    narrowed.run(70.0, 3e6)
    assert narrowed.control.rates.bitrate >= never_narrow.control.rates.bitrate / STEP**2


def test_a_link_that_narrows_is_obeyed_at_once_and_one_that_widens_step_by_step() -> None:
    loop = Loop(10.0, 0.5, 1.0)
    loop.run(10.0, 2e6)
    wide = loop.control.rates.bitrate
    loop.control.link(loop.t + 0.1, link(loop.t + 0.1, 2e5))
    assert loop.control.rates.bitrate <= SHARE * 2e5 < wide
    narrow = loop.control.rates.bitrate
    loop.run(1.5, 2e6)
    assert loop.control.rates.bitrate == narrow, "not before there has been room for a while"
    loop.run(20.0, 2e6)
    assert loop.control.rates.bitrate == wide


def test_a_modem_that_tells_of_no_limit_is_given_the_fastest_rate() -> None:
    control = RateController(20.0, 0.9)
    status = LinkStatus(t=0.0, bandwidth=-1e308, latency=0.0, loss=1e300, queued=0.0, sent=0.0, dropped=0)
    control.link(0.0, status)
    assert SLOWEST_RATE < control.rates.bitrate <= FASTEST_RATE


def test_poor_pictures_cost_frame_rate_first() -> None:
    loop = Loop(5.0, 0.85, 1.0)
    loop.run(30.0, 2e6)
    assert loop.control.rates.fps == 15.0
    loop.run(20.0, 1e5)
    assert loop.control.rates.fps == 6.0
    loop.run(60.0, 2e6)
    assert loop.control.rates.fps == 15.0


@given(st.lists(st.tuples(st.floats(0.01, 2.0), st.booleans()), max_size=60))
def test_a_shortfall_is_bad_time_that_good_time_has_not_made_up_for(story: list[tuple[float, bool]]) -> None:
    shortfall, t, expected = Shortfall(0.0), 0.0, 0.0
    for step, good in story:
        t += step
        expected = max(0.0, expected - step) if good else expected + step
        assert math.isclose(shortfall.observe(t, good=good), expected, abs_tol=1e-9)
    if all(good for _, good in story):
        assert shortfall.total == 0.0


def test_a_shortfall_that_begins_later_does_not_count_before() -> None:
    shortfall = Shortfall(3.0)
    assert shortfall.observe(2.0, good=False) == 0.0
    assert shortfall.observe(3.5, good=False) == 0.5
