"""Registration of a scan with the planes of the map: information and gradient of the drone's pose.

The planes' normals have errors, too. A normal that is tilted by chance seems to fix the drone along its plane, where
nothing does. It draws the drone back to where the plane was seen from: a ring across the track would follow its own
traces. The spurious information and gradient of such normals are known on average. They are subtracted, as in
bias-compensated least squares (Stoica and Soderstrom, "Bias correction in least-squares identification", 1982).

A plane gives the drone's pose relative to the keyframe that the plane was mapped from (`keyframes.py`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from skillwing.onboard.odometry import so3
from skillwing.onboard.odometry.filter import Evidence
from skillwing.onboard.odometry.plane_map import PlaneMap
from skillwing.onboard.odometry.so3 import Floats
from skillwing.onboard.odometry.state import FilterState

RANGE_SIGMA = 0.05
"""Standard deviation of a point about its plane [m]: the sensor's noise and the unevenness of surfaces."""
WEIGHT = 0.05
"""Weight of a scan's evidence. Points of one scan have common errors: a plane wrong by a centimetre is so for all its
points. So they weigh less than as many independent ones."""
_ARM = 5.0
"""Lever arm by which rotations and translations are compared [m]."""
_LEAST = 1e-9
"""Least share of all information in any direction, for numerical stability."""
_CLOSE = 0.15
_GATES = (0.3, 0.3, _CLOSE, _CLOSE)
"""Largest distance of a point from its plane in each iteration [m]. Points within the last gate count as close in any
iteration. Gates are widened by three standard deviations of the plane's roughness."""


@dataclass(frozen=True, slots=True)
class Agreement:
    """Numbers of a scan's `points`, of those that `matched` a plane, and of those `close` to their plane.

    A plane without a recent confirmation counts as matched only by close points: other points show the drone's drift
    since the plane was mapped, and nothing about the scan.
    """

    points: int
    matched: int
    close: int

    @property
    def share(self) -> float:
        """Share of the points, 0 to 1, that lie on known planes."""
        return self.close / self.points if self.points else 0.0


class ScanRegistration:
    """Comparison of one scan, as points (N, 3) and its `sensor` (3,) in body axes, with a map of planes."""

    def __init__(self, points: Floats, sensor: Floats, planes: PlaneMap) -> None:
        self._points, self._sensor, self._planes = points, sensor, planes
        self.agreement = Agreement(len(points), 0, 0)
        self.met: NDArray[np.int32] = np.empty(0, dtype=np.int32)
        self.close: NDArray[np.bool_] = np.empty(0, dtype=np.bool_)
        """Results of the last call: planes (N,) with points in their voxels, and points close to their plane (N,)."""

    def __call__(self, state: FilterState, iteration: int) -> Evidence:
        """The evidence at a state; sets `agreement`."""
        matches = self._planes.match(state.placed(self._points), state.to_world(self._sensor))
        points = self._points[matches.points]
        slopes, spurious = (_slopes(ways, points, state) for ways in (matches.normals, matches.loose))
        shifts = _shifts(state, matches.keyframes)
        distances = matches.distances - np.einsum("ij,ij->i", slopes, shifts)
        levers = matches.levers - np.einsum("ij,ij->i", spurious, shifts)
        beyond = np.abs(distances) - 3.0 * np.sqrt(matches.roughness)
        self.met, self.close = matches.planes, beyond < _CLOSE
        matched = np.count_nonzero(self.close | matches.lately)
        self.agreement = Agreement(len(self._points), int(matched), int(np.count_nonzero(self.close)))
        # Cauchy weights: a point off its plane counts less, and one far from it not at all.
        variances = RANGE_SIGMA**2 + matches.roughness + matches.plane_variances
        near = beyond < _GATES[min(iteration, len(_GATES) - 1)]
        weights = near * WEIGHT / (variances + 0.25 * distances**2)
        weighted, spurious_weighted = slopes * weights[:, None], spurious * (weights * matches.tilts)[:, None]
        correction = _correction(weighted.T @ slopes, spurious_weighted.T @ spurious)
        pulls = spurious_weighted * levers[:, None] - weighted * distances[:, None]
        # All planes mapped before the oldest kept keyframe are treated alike.
        mapped_from = np.maximum(matches.keyframes - state.keyframes.oldest, -1)
        order = np.argsort(mapped_from, kind="stable")
        ends = np.searchsorted(mapped_from[order], np.arange(state.keyframes.kept))
        parts = zip(*(np.split(rows[order], ends) for rows in (weighted, slopes, pulls)), strict=True)
        sums = [(some.T @ along, pull.sum(axis=0)) for some, along, pull in parts]
        information, pull = (np.stack(part) for part in zip(*sums, strict=True))
        return _evidence(state, correction @ information @ correction.T, pull @ correction.T)


def _evidence(state: FilterState, information: Floats, pulls: Floats) -> Evidence:
    """Evidence on a state by information (1 + K, 6, 6) and gradients (1 + K, 6) of relative poses of the drone.

    They are relative to the planes mapped before the K kept keyframes, and to those of each.
    """
    ways = state.poses_from_keyframes()
    size = ways.shape[2]
    across = ways.transpose(2, 0, 1).reshape(size, -1)
    return Evidence(across @ (information @ ways).reshape(-1, size), across @ pulls.ravel())


def _shifts(state: FilterState, numbers: NDArray[np.int64]) -> Floats:
    """Errors (N, 6) of planes mapped from the keyframes of these numbers (N,), as errors of the pose; 0 for planes
    mapped from none, with number -1."""
    which, places = np.unique(numbers, return_inverse=True)
    moves = np.zeros((len(which), 6))
    known = which >= 0
    views = state.keyframes.seen_from(state.position, state.turn, which[known])
    moves[known] = np.einsum("kij,kj->ki", views, state.keyframes.shifts[which[known]])
    return moves[places]


def _slopes(directions: Floats, points: Floats, state: FilterState) -> Floats:
    """Derivatives (N, 6) of points (N, 3) in body axes along these unit vectors (N, 3) by errors of the pose."""
    return np.column_stack([directions, *so3.crossed(points.T, (directions @ state.turn).T)])


def _correction(apparent: Floats, spurious: Floats) -> Floats:
    """Correction matrix (6, 6) for gradients, from the apparent information (6, 6) and its spurious part.

    Multiply gradients by it from one side, and information from both sides. It follows from all points together, and is
    applied to those of each keyframe.

    The noise in a gradient is that of all points. So where most information is spurious, the rest weighs less than its
    amount, and nothing if the difference is negative.
    """
    units = np.array([1.0, 1.0, 1.0, _ARM, _ARM, _ARM])
    scale = np.outer(units, units)
    values, vectors = np.linalg.eigh((apparent - spurious) / scale)
    left = (vectors * np.maximum(values, 0.0)) @ vectors.T
    whole = apparent / scale
    whole[np.diag_indices_from(whole)] += _LEAST * (1.0 + np.trace(whole))
    share = np.asarray(np.linalg.solve(whole, left).T, dtype=np.float64)
    return share * np.outer(units, 1.0 / units)
