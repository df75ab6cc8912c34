"""Stall detector: quantities that stop growing."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from skillwing.m600.skills.timers import StallDetector


def test_standing_still_is_stalled_after_the_patience() -> None:
    detector = StallDetector(10.0, 2.0, patience=5.0)
    assert not detector.stalled(14.9, 2.0)
    assert detector.stalled(15.0, 2.0)


def test_slow_creeping_counts() -> None:
    detector = StallDetector(0.0, 0.0, patience=5.0, least=0.1)
    assert not any(detector.stalled(t, 0.03 * t) for t in range(60))


def test_oscillation_is_no_headway() -> None:
    detector = StallDetector(0.0, 0.0, patience=5.0, least=0.1)
    assert [detector.stalled(t, 0.09 * (t % 2)) for t in range(8)] == [False] * 5 + [True] * 3


@given(st.lists(st.floats(-50, 50), min_size=1, max_size=60))
def test_never_stalled_before_the_patience_and_always_after_it_without_growth(values: list[float]) -> None:
    detector = StallDetector(0.0, 50.0, patience=5.0)
    for t, value in enumerate(values):
        assert detector.stalled(float(t), value) == (t >= 5.0)
