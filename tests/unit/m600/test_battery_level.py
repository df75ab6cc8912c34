"""Battery percentage to battery status."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from skillwing.m600.bridge.levels import BatteryLevel, BatteryStatus

NORMAL, LOW, CRITICAL = BatteryStatus.NORMAL, BatteryStatus.LOW, BatteryStatus.CRITICAL


@pytest.mark.parametrize(
    ("percents", "status"),
    [
        ([100.0], NORMAL),
        ([30.0], NORMAL),
        ([29.9], LOW),
        ([14.9], CRITICAL),
        ([29.9, 30.1], LOW),
        ([29.9, 33.0], NORMAL),
        ([14.9, 15.1], CRITICAL),
        ([14.9, 18.0], LOW),
        ([14.9, 32.0], LOW),
        ([14.9, 60.0], NORMAL),
    ],
)
def test_gets_worse_at_once_and_better_with_some_reserve(percents: list[float], status: BatteryStatus) -> None:
    level = BatteryLevel()
    for percent in percents:
        level.update(percent)
    assert level.status is status


@given(st.lists(st.floats(0, 100), max_size=20), st.floats(0, 100))
def test_is_never_better_than_the_thresholds_say(before: list[float], percent: float) -> None:
    ranks = {NORMAL: 0, LOW: 1, CRITICAL: 2}
    level = BatteryLevel()
    for earlier in before:
        level.update(earlier)
    assert ranks[level.update(percent)] >= ranks[BatteryLevel().update(percent)]


@given(st.floats(1.5, 98.5), st.lists(st.floats(-1.0, 1.0), min_size=2, max_size=30))
def test_noise_changes_the_status_once_at_most(percent: float, noise: list[float]) -> None:
    level = BatteryLevel()
    seen = [level.update(percent + each) for each in noise]
    assert sum(a is not b for a, b in pairwise(seen)) <= 1
