"""How well a scan lies on the planes of the map, and which way it would have to move to lie better.

The planes' normals err as well. One that leans by chance seems to hold the drone along its plane, where nothing does,
and draws it back to where the plane was seen from: a ring across the track would follow its own traces. What normals of
these variances feign on average, of information and of pull, is known, and is taken away, as in bias-compensated least
squares (Stoica and Soderstrom, "Bias correction in least-squares identification", 1982).

A plane tells where the drone is as seen from the keyframe that the plane was laid from (`keyframes.py`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from skillwing.onboard.odometry import so3
from skillwing.onboard.odometry.filter import Evidence
from skillwing.onboard.odometry.plane_map import PlaneMap
from skillwing.onboard.odometry.so3 import Floats
from skillwing.onboard.odometry.state import State

RANGE_SIGMA = 0.05
"""Of a point about its plane [m]: the sensor's noise and what the world has of unevenness."""
WEIGHT = 0.05
"""Of a scan's evidence. Points of one scan err together (a plane wrong by a centimetre is so for all of its points), so
that they say less than as many independent ones."""
_ARM = 5.0
"""A turn moves what is so far away: by this turns and moves are compared [m]."""
_LEAST = 1e-9
"""Share of all information that is never missing in any direction, for numbers' sake."""
_CLOSE = 0.15
_GATES = (0.3, 0.3, _CLOSE, _CLOSE)
"""Points farther from their plane than this in each iteration are left out [m], and those within the last gate are
close to it, however soon the filter was content. Both are widened by three standard deviations of the plane's
unevenness."""


@dataclass(frozen=True, slots=True)
class Agreement:
    """Of so many `points` of a scan some `matched` a plane, of which some were `close` to it.

    A plane on which no scan has lain lately matches those only that are close: elsewhere it tells how far the drone
    has drifted since it was there, and nothing of the scan.
    """

    points: int
    matched: int
    close: int

    @property
    def share(self) -> float:
        """Share of the points, 0 to 1, that lie on known planes."""
        return self.close / self.points if self.points else 0.0


class Registration:
    """Compares one scan, as points (N, 3) and its `sensor` (3,) in body axes, with a map of planes."""

    def __init__(self, points: Floats, sensor: Floats, planes: PlaneMap) -> None:
        self._points, self._sensor, self._planes = points, sensor, planes
        self.agreement = Agreement(len(points), 0, 0)
        self.met: NDArray[np.int32] = np.empty(0, dtype=np.int32)
        self.close: NDArray[np.bool_] = np.empty(0, dtype=np.bool_)
        """The planes (N,) in whose voxels there were points at the last look, and whether these were close (N,)."""

    def __call__(self, state: State, iteration: int) -> Evidence:
        """The evidence at a state; `agreement` tells afterwards how good it is."""
        matches = self._planes.match(state.placed(self._points), state.to_world(self._sensor))
        points = self._points[matches.points]
        slopes, feigned = (_slopes(ways, points, state) for ways in (matches.normals, matches.loose))
        shifts = _shifts(state, matches.keyframes)
        distances = matches.distances - np.einsum("ij,ij->i", slopes, shifts)
        levers = matches.levers - np.einsum("ij,ij->i", feigned, shifts)
        beyond = np.abs(distances) - 3.0 * np.sqrt(matches.roughness)
        self.met, self.close = matches.planes, beyond < _CLOSE
        matched = np.count_nonzero(self.close | matches.lately)
        self.agreement = Agreement(len(self._points), int(matched), int(np.count_nonzero(self.close)))
        # Cauchy's weights: what does not lie on its plane counts less, and what is far from it not at all.
        variances = RANGE_SIGMA**2 + matches.roughness + matches.doubt
        near = beyond < _GATES[min(iteration, len(_GATES) - 1)]
        weights = near * WEIGHT / (variances + 0.25 * distances**2)
        weighted, doubted = slopes * weights[:, None], feigned * (weights * matches.tilts)[:, None]
        real = _real(weighted.T @ slopes, doubted.T @ feigned)
        pulls = doubted * levers[:, None] - weighted * distances[:, None]
        # All that was laid before the oldest that is kept is alike.
        laid_from = np.maximum(matches.keyframes - state.keyframes.oldest, -1)
        order = np.argsort(laid_from, kind="stable")
        ends = np.searchsorted(laid_from[order], np.arange(state.keyframes.kept))
        parts = zip(*(np.split(rows[order], ends) for rows in (weighted, slopes, pulls)), strict=True)
        told = [(some.T @ along, pull.sum(axis=0)) for some, along, pull in parts]
        information, pull = (np.stack(part) for part in zip(*told, strict=True))
        return _evidence(state, real @ information @ real.T, pull @ real.T)


def _evidence(state: State, information: Floats, pulls: Floats) -> Evidence:
    """What planes tell of a state, information (1 + K, 6, 6) and pulls (1 + K, 6) of where the drone is as seen from
    what was laid before the K keyframes that are kept, and from each of these."""
    ways = state.ways_from_keyframes()
    size = ways.shape[2]
    across = ways.transpose(2, 0, 1).reshape(size, -1)
    return Evidence(across @ (information @ ways).reshape(-1, size), across @ pulls.ravel())


def _shifts(state: State, numbers: NDArray[np.int64]) -> Floats:
    """By how much (N, 6) planes lie wrong that were laid from the keyframes of these numbers (N,), as errors of the
    pose; 0 for those that were laid from none, with number -1."""
    which, places = np.unique(numbers, return_inverse=True)
    moves = np.zeros((len(which), 6))
    known = which >= 0
    views = state.keyframes.seen_from(state.position, state.turn, which[known])
    moves[known] = np.einsum("kij,kj->ki", views, state.keyframes.shifts[which[known]])
    return moves[places]


def _slopes(directions: Floats, points: Floats, state: State) -> Floats:
    """How far points (N, 3) in body axes go along these unit vectors (N, 3) for each error of the pose (N, 6)."""
    return np.column_stack([directions, *so3.crossed(points.T, (directions @ state.turn).T)])


def _real(seeming: Floats, feigned: Floats) -> Floats:
    """What is real (6, 6) of what points pull, where they seem to hold so much information (6, 6), of which so much is
    feigned. A pull times this, and information times this from both sides, are what is left of them: that is known of
    all points together, and taken for those of each keyframe.

    The noise in a pull is that of all points, so that where most is feigned, what is left tells less than its amount,
    and nothing where less than nothing is left.
    """
    units = np.array([1.0, 1.0, 1.0, _ARM, _ARM, _ARM])
    scale = np.outer(units, units)
    values, vectors = np.linalg.eigh((seeming - feigned) / scale)
    left = (vectors * np.maximum(values, 0.0)) @ vectors.T
    whole = seeming / scale
    whole[np.diag_indices_from(whole)] += _LEAST * (1.0 + np.trace(whole))
    share = np.asarray(np.linalg.solve(whole, left).T, dtype=np.float64)
    return share * np.outer(units, 1.0 / units)
