"""What odometry thinks of a scan, beside what it says of the scans before."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from skillwing.onboard.odometry.divergence_monitor import (
    FEWEST_MATCHES,
    LARGEST_SURPRISE,
    LEAST_CLOSE,
    REMEMBERED,
    Judge,
    Judgement,
)
from skillwing.onboard.odometry.filter import Posterior
from skillwing.onboard.odometry.registration import Agreement
from skillwing.onboard.odometry.state import SIZE, State

SOUND = Agreement(1000, 900, 895)
COVARIANCE = np.diag(np.linspace(0.01, 1.0, SIZE + 12))


def judged(judge: Judge, surprise: float, agreement: Agreement = SOUND) -> Judgement:
    """A scan that changes the prediction by so much, in squared standard deviations."""
    step = np.zeros(len(COVARIANCE))
    step[7] = np.sqrt(surprise * COVARIANCE[7, 7])
    state = State(np.zeros(3), np.eye(3), np.zeros(3), np.zeros(3), np.zeros(3))
    return judge(agreement, COVARIANCE, Posterior(state, COVARIANCE, step))


@given(st.floats(0.0, 2.0 * LARGEST_SURPRISE))
def test_one_scan_is_believed_as_long_as_it_changes_little(surprise: float) -> None:
    judgement = judged(Judge(), surprise)
    assert np.isclose(judgement.surprise, surprise)
    assert bool(judgement.doubt) is (judgement.surprise > LARGEST_SURPRISE)


@given(st.floats(1.2 * (1.0 - REMEMBERED), 0.9))
def test_many_small_contradictions_are_one_large_one(share: float) -> None:
    """A frozen sensor contradicts the other with each scan by a share of what one may."""
    judge, scans = Judge(), 0
    while not (judgement := judged(judge, share * LARGEST_SURPRISE)).doubt:
        scans += 1
        assert scans < 30
    assert scans > 0
    assert "contradicts the inertial measurements" in judgement.doubt


@given(st.floats(0.0, 0.9 * (1.0 - REMEMBERED)), st.integers(1, 1000))
def test_scans_that_contradict_next_to_nothing_are_believed_for_ever(share: float, scans: int) -> None:
    judge = Judge()
    assert not any(judged(judge, share * LARGEST_SURPRISE).doubt for _ in range(scans))


@given(st.lists(st.floats(0.0, 1e6), max_size=30))
def test_the_first_sound_scan_is_believed_however_wrong_the_ones_before_were(before: list[float]) -> None:
    judge = Judge()
    for surprise in before:
        judged(judge, surprise)
    assert judged(judge, 0.0).doubt == ""


@given(st.floats(0.0, 0.9 * LARGEST_SURPRISE), st.sampled_from(["few", "misfit", "surprising"]))
def test_a_doubted_scan_is_remembered_as_none(believed: float, why: str) -> None:
    """What it would have changed, the next one would change again."""
    wrong = {
        "few": (0.5 * LARGEST_SURPRISE, Agreement(1000, FEWEST_MATCHES - 1, FEWEST_MATCHES - 1)),
        "misfit": (0.5 * LARGEST_SURPRISE, Agreement(1000, 900, int(900 * LEAST_CLOSE) - 1)),
        "surprising": (2.0 * LARGEST_SURPRISE, SOUND),
    }
    judge = Judge()
    judged(judge, believed)
    assert judged(judge, *wrong[why]).doubt
    assert np.isclose(judged(judge, 0.0).surprise, REMEMBERED**2 * believed)


def test_another_kind_of_map_has_other_limits() -> None:
    judge = Judge(least_close=0.3, largest_surprise=100.0, remembered=0.0)
    sparse = Agreement(1000, 1000, 310)
    assert not any(judged(judge, 99.0, sparse).doubt for _ in range(5))
    assert judged(judge, 101.0, sparse).doubt
    assert judged(judge, 0.0, Agreement(1000, 1000, 290)).doubt
