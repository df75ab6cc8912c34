"""What odometry thinks of a scan, beside what it says of the scans before."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from skillwing.sim_mujoco.slam.filter import Posterior
from skillwing.sim_mujoco.slam.registration import Agreement
from skillwing.sim_mujoco.slam.state import SIZE, State
from skillwing.sim_mujoco.slam.vigil import LARGEST_SURPRISE, REMEMBERED, Judgement, judge

SOUND = Agreement(1000, 900, 895)
COVARIANCE = np.diag(np.linspace(0.01, 1.0, SIZE + 12))


def judged(surprise: float, before: float) -> Judgement:
    """A scan that changes the prediction by so much, in squared standard deviations."""
    step = np.zeros(len(COVARIANCE))
    step[7] = np.sqrt(surprise * COVARIANCE[7, 7])
    state = State(np.zeros(3), np.eye(3), np.zeros(3), np.zeros(3), np.zeros(3))
    return judge(SOUND, COVARIANCE, Posterior(state, COVARIANCE, step), before)


@given(st.floats(0.0, 2.0 * LARGEST_SURPRISE))
def test_one_scan_is_believed_as_long_as_it_changes_little(surprise: float) -> None:
    judgement = judged(surprise, 0.0)
    assert np.isclose(judgement.surprise, surprise)
    assert bool(judgement.doubt) is (judgement.surprise > LARGEST_SURPRISE)


@given(st.floats(1.2 * (1.0 - REMEMBERED), 0.9))
def test_many_small_contradictions_are_one_large_one(share: float) -> None:
    """A frozen sensor contradicts the other with each scan by a share of what one may."""
    surprise, scans = 0.0, 0
    while not (judgement := judged(share * LARGEST_SURPRISE, surprise)).doubt:
        surprise, scans = judgement.surprise, scans + 1
        assert scans < 30
    assert judged(share * LARGEST_SURPRISE, 0.0).doubt == ""
    assert "contradicts the inertial measurements" in judgement.doubt


@given(st.floats(0.0, 0.9 * (1.0 - REMEMBERED)), st.integers(1, 1000))
def test_scans_that_contradict_next_to_nothing_are_believed_for_ever(share: float, scans: int) -> None:
    surprise = 0.0
    for _ in range(scans):
        judgement = judged(share * LARGEST_SURPRISE, surprise)
        assert judgement.doubt == ""
        surprise = judgement.surprise


@given(st.floats(0.0, 1e6))
def test_the_first_sound_scan_is_believed_however_wrong_the_ones_before_were(before: float) -> None:
    assert judged(0.0, before).doubt == ""
