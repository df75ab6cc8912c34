"""small_gicp (Koide, JOSS 2024) instead of our own registration, for comparison.

VGICP (Koide et al., 2021) registers each scan with all scans before it: points with the spread of their neighbours,
against voxels with the spread of their points. The filter takes its map for exact: there are no keyframes. The rest is
as with our planes. Registration begins at the predicted pose, and inertial measurements deskew the scans. The filter
weighs the registered pose by its Hessian; a direction without information is left to the inertial measurements.
"""

from __future__ import annotations

import importlib
from dataclasses import replace
from types import ModuleType
from typing import Any, Final

import numpy as np

from skillwing.onboard.odometry.deskew import StillScan
from skillwing.onboard.odometry.divergence_monitor import InnovationGate
from skillwing.onboard.odometry.filter import Evidence, update
from skillwing.onboard.odometry.matching import MakeMatcher, Match, unchanged
from skillwing.onboard.odometry.propagation import Prediction
from skillwing.onboard.odometry.registration import Agreement
from skillwing.onboard.odometry.so3 import Floats
from skillwing.onboard.odometry.state import ATTITUDE, POSE, POSITION, FilterState

VOXEL: Final = 0.35
"""Side of the voxels of the map [m]."""
_CELL, _NEIGHBOURS = 0.25, 20
"""Side of the cubes in which points are thinned to one [m], and number of neighbours that give their spread."""
_FARTHEST = 0.5
"""Largest distance of a point from its voxel [m]."""
_LEAST_CLOSE = 0.3
"""Least share of points with a voxel. Unlike our registration, small_gicp does not separate points that contradict the
map from new ones: on a sound flight half of the points were new for some scans in a row."""
_WEIGHT = 0.25
"""Weight of a scan's evidence: its points have common errors."""
_LARGEST_NIS = 100.0
"""Limit of one scan by itself, which weighs more than one of ours: 45 was seen on a sound flight."""
_KEPT_SCANS, _CLEARING = 1_000_000, 1000
"""Scans without a voxel after which small_gicp may drop it, and period of its clean-up. Our map drops none."""


class MissingLibraryError(ImportError):
    """small_gicp is not installed."""

    def __init__(self) -> None:
        super().__init__(
            "poses by `small-gicp` need the package `small_gicp`, which is not installed; "
            "install it with `pip install 'skillwing[comparison]'`, or choose other poses"
        )


def gicp_matcher() -> MakeMatcher:
    """A maker of matchers that use small_gicp. Raises MissingLibraryError."""
    try:
        # By its name: it is optional, and has no type hints.
        library = importlib.import_module("small_gicp")
    except ImportError as error:
        raise MissingLibraryError from error
    return lambda low, high: GicpMatcher(library)


class GicpMatcher:
    """Registration with an unbounded voxel map, in one thread, so that the same scans give the same poses."""

    def __init__(self, library: ModuleType) -> None:
        self._library = library
        self._map: Any = library.GaussianVoxelMap(VOXEL)
        self._map.set_lru(_KEPT_SCANS, _CLEARING)
        self._gate = InnovationGate(_LEAST_CLOSE, _LARGEST_NIS, remembered=0.0)
        self._empty = True

    def match(self, predicted: Prediction, scan: StillScan) -> Match:
        cloud, _ = self._library.preprocess_points(scan.points.astype(np.float64), _CELL, _NEIGHBOURS)
        match = self._first(predicted, cloud) if self._empty else self._register(predicted, cloud)
        if match.accepted:
            self._map.insert(cloud, _transform(match.posterior.state))
            self._empty = False
        return match

    def _first(self, predicted: Prediction, cloud: Any) -> Match:
        return Match(unchanged(predicted), Agreement(cloud.size(), 0, 0), None)

    def _register(self, predicted: Prediction, cloud: Any) -> Match:
        prior, covariance = predicted.state, predicted.covariance
        registered = self._library.align(
            self._map, cloud, _transform(prior), max_correspondence_distance=_FARTHEST, num_threads=1
        )
        seen = _moved(prior, registered.T_target_source)
        information = _WEIGHT * _information(registered.H, seen.turn)
        posterior = update(
            prior, covariance, lambda state, _: Evidence(information, information @ seen.minus(state)[POSE])
        )
        agreement = Agreement(cloud.size(), cloud.size(), registered.num_inliers)
        result = self._gate(agreement, covariance, posterior)
        return Match(unchanged(predicted) if result.rejection else posterior, agreement, result)


def _transform(state: FilterState) -> Floats:
    """The pose as a homogeneous matrix (4, 4) from body to world."""
    transform = np.eye(4)
    transform[:3, :3], transform[:3, 3] = state.turn, state.position
    return transform


def _moved(state: FilterState, transform: Floats) -> FilterState:
    """The same state with another pose."""
    turn, position = transform[:3, :3], transform[:3, 3]
    return replace(state, position=position, turn=turn)


def _information(hessian: Floats, turn: Floats) -> Floats:
    """The information matrix (6, 6) of a pose's error in the filter's order.

    small_gicp moves a pose in body axes, first the rotation and then the translation; the filter's error of the
    position is in world axes, and comes first.
    """
    step = np.zeros((6, 6))
    step[:3, ATTITUDE], step[3:, POSITION] = np.eye(3), turn.T
    return step.T @ hessian @ step
