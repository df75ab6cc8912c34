"""Innovation gate: acceptance of a scan, by itself and with those before."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from skillwing.onboard.odometry.divergence_monitor import (
    FEWEST_MATCHES,
    LARGEST_NIS,
    LEAST_CLOSE,
    REMEMBERED,
    GateResult,
    InnovationGate,
)
from skillwing.onboard.odometry.filter import Posterior
from skillwing.onboard.odometry.registration import Agreement
from skillwing.onboard.odometry.state import SIZE, FilterState

SOUND = Agreement(1000, 900, 895)
COVARIANCE = np.diag(np.linspace(0.01, 1.0, SIZE + 12))


def judged(gate: InnovationGate, nis: float, agreement: Agreement = SOUND) -> GateResult:
    """Result for a scan that changes the prediction by `nis`, in squared standard deviations."""
    step = np.zeros(len(COVARIANCE))
    step[7] = np.sqrt(nis * COVARIANCE[7, 7])
    state = FilterState(np.zeros(3), np.eye(3), np.zeros(3), np.zeros(3), np.zeros(3))
    return gate(agreement, COVARIANCE, Posterior(state, COVARIANCE, step))


@given(st.floats(0.0, 2.0 * LARGEST_NIS))
def test_one_scan_is_believed_as_long_as_it_changes_little(nis: float) -> None:
    result = judged(InnovationGate(), nis)
    assert np.isclose(result.nis, nis)
    assert bool(result.rejection) is (result.nis > LARGEST_NIS)


@given(st.floats(1.2 * (1.0 - REMEMBERED), 0.9))
def test_many_small_contradictions_are_one_large_one(share: float) -> None:
    """A frozen sensor contradicts the other one with each scan, by a share of the limit."""
    gate, scans = InnovationGate(), 0
    while not (result := judged(gate, share * LARGEST_NIS)).rejection:
        scans += 1
        assert scans < 30
    assert scans > 0
    assert "contradicts the inertial measurements" in result.rejection


@given(st.floats(0.0, 0.9 * (1.0 - REMEMBERED)), st.integers(1, 1000))
def test_scans_that_contradict_next_to_nothing_are_believed_for_ever(share: float, scans: int) -> None:
    gate = InnovationGate()
    assert not any(judged(gate, share * LARGEST_NIS).rejection for _ in range(scans))


@given(st.lists(st.floats(0.0, 1e6), max_size=30))
def test_the_first_sound_scan_is_believed_however_wrong_the_ones_before_were(before: list[float]) -> None:
    gate = InnovationGate()
    for nis in before:
        judged(gate, nis)
    assert judged(gate, 0.0).rejection == ""


@given(st.floats(0.0, 0.9 * LARGEST_NIS), st.sampled_from(["few", "mismatch", "surprising"]))
def test_a_doubted_scan_is_remembered_as_none(believed: float, why: str) -> None:
    """The innovation of a rejected scan appears again in the next one."""
    wrong = {
        "few": (0.5 * LARGEST_NIS, Agreement(1000, FEWEST_MATCHES - 1, FEWEST_MATCHES - 1)),
        "mismatch": (0.5 * LARGEST_NIS, Agreement(1000, 900, int(900 * LEAST_CLOSE) - 1)),
        "surprising": (2.0 * LARGEST_NIS, SOUND),
    }
    gate = InnovationGate()
    judged(gate, believed)
    assert judged(gate, *wrong[why]).rejection
    assert np.isclose(judged(gate, 0.0).nis, REMEMBERED**2 * believed)


def test_another_kind_of_map_has_other_limits() -> None:
    gate = InnovationGate(least_close=0.3, largest_nis=100.0, remembered=0.0)
    sparse = Agreement(1000, 1000, 310)
    assert not any(judged(gate, 99.0, sparse).rejection for _ in range(5))
    assert judged(gate, 101.0, sparse).rejection
    assert judged(gate, 0.0, Agreement(1000, 1000, 290)).rejection
