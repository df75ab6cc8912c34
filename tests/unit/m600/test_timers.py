"""Stall detector and link trouble: rules about time that skills end by."""

from __future__ import annotations

import math

from hypothesis import given
from hypothesis import strategies as st

from skillwing.m600.skills.link_trouble import AFTERMATH, LinkTrouble
from skillwing.m600.skills.timers import StallDetector
from skillwing.services.protocol import Record, RecordKind


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


@given(st.lists(st.tuples(st.floats(0.0, 100.0), st.sampled_from(["GOOD", "DEGRADED", "LOST"]))), st.floats(0.0, 120.0))
def test_a_bad_video_comes_of_the_last_trouble_of_the_link_unless_that_was_long_over(
    changes: list[tuple[float, str]], since: float
) -> None:
    trouble = LinkTrouble()
    last: str | None = None
    good_at = -math.inf
    for number, (t, state) in enumerate(sorted(changes)):
        trouble.note(change(number, t, state))
        last, good_at = (last, t) if state == "GOOD" else (f"rm#{number}", math.inf)
    expected = last if since - good_at <= AFTERMATH else None
    assert trouble.cause_of_trouble(since) == expected


def change(number: int, t: float, state: str) -> Record:
    return Record(
        id=f"rm#{number}",
        t=t,
        source="resource_manager",
        kind=RecordKind.RESOURCE,
        subject="link_status",
        before=None,
        after=state,
    )
