"""The iterated error-state Kalman filter that fuses inertial measurements with the distances of points from planes.

The scheme is that of FAST-LIO (Xu and Zhang, 2021) and FAST-LIO2 (Xu et al., 2022): propagate by the IMU, then update
with a whole scan at once. The cost of this form depends on the size of the state and not on the number of points.
Iterating it is a Gauss-Newton solution of the maximum-a-posteriori problem (Bell and Cathey, "The iterated Kalman
filter update as a Gauss-Newton method", 1993).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from skillwing.onboard.odometry.so3 import Floats
from skillwing.onboard.odometry.state import ATTITUDE, POSITION, FilterState

MOST_ITERATIONS = 4
_SMALL_MOVE, _SMALL_TURN = 1e-3, 1e-4


@dataclass(frozen=True, slots=True)
class Evidence:
    """Evidence of a scan, linearised at a state: information matrix (M, M) of the state's first errors, and gradient
    (M,) towards the map. The first six errors are those of the pose."""

    information: Floats
    gradient: Floats


@dataclass(frozen=True, slots=True)
class Posterior:
    """The state after a scan and the covariance (N, N) of its error. `step` (N,) is the scan's correction."""

    state: FilterState
    covariance: Floats
    step: Floats


def update(
    prior: FilterState,
    covariance: Floats,
    evaluate: Callable[[FilterState, int], Evidence],
    iterations: int = MOST_ITERATIONS,
) -> Posterior:
    """Find the state that agrees best with both the prior and the scan.

    `evaluate(state, iteration)` compares the scan with the map at a state.
    """
    prior_information = _inverse(covariance)
    information, state = prior_information, prior
    for iteration in range(iterations):
        evidence = evaluate(state, iteration)
        information = prior_information.copy()
        seen = slice(0, len(evidence.gradient))
        information[seen, seen] += evidence.information
        pull = -prior_information @ state.minus(prior)
        pull[seen] += evidence.gradient
        step = np.asarray(np.linalg.solve(information, pull), dtype=np.float64)
        state = state.plus(step)
        if np.linalg.norm(step[POSITION]) < _SMALL_MOVE and np.linalg.norm(step[ATTITUDE]) < _SMALL_TURN:
            break
    return Posterior(state, _inverse(information), state.minus(prior))


def _inverse(matrix: Floats) -> Floats:
    """Inverse of a symmetric matrix, kept symmetric despite rounding."""
    inverse = np.asarray(np.linalg.inv(matrix), dtype=np.float64)
    return 0.5 * (inverse + inverse.T)
