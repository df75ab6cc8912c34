"""Matching of a scan with the map: the exchangeable part of odometry."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from skillwing.onboard.frames.vectors import Vector
from skillwing.onboard.odometry.deskew import StillScan, thinned
from skillwing.onboard.odometry.divergence_monitor import GateResult, InnovationGate
from skillwing.onboard.odometry.filter import Posterior, update
from skillwing.onboard.odometry.plane_map import PlaneMap
from skillwing.onboard.odometry.propagation import Prediction
from skillwing.onboard.odometry.registration import Agreement, ScanRegistration

VOXEL = 1.0
"""Side of the voxels that hold a plane each [m]."""
_MATCHED_CELL, _INSERTED_CELL = 0.35, 0.12
"""Sides of the cubes in which points are thinned to one, for matching and for insertion [m]."""


@dataclass(frozen=True, slots=True)
class Match:
    """Result of a scan: the state after it, its agreement with the map, and the gate's result, None for the first
    scan."""

    posterior: Posterior
    agreement: Agreement
    result: GateResult | None

    @property
    def accepted(self) -> bool:
        """The scan was used."""
        return self.result is None or not self.result.rejection


class Matcher(Protocol):
    """Matcher of scans with a map of its own, into which it inserts the accepted ones."""

    def match(self, predicted: Prediction, scan: StillScan) -> Match: ...


MakeMatcher = Callable[[Vector, Vector], Matcher]
"""Makes a matcher with an empty map of the box between two corners [m]."""


def unchanged(predicted: Prediction) -> Posterior:
    """The posterior without a scan."""
    return Posterior(predicted.state, predicted.covariance, np.zeros(len(predicted.covariance)))


class PlaneMatcher:
    """Matcher by distances of points from planes, weighed against inertial measurements in one filter."""

    def __init__(self, low: Vector, high: Vector) -> None:
        self._map = PlaneMap(low, high, VOXEL)
        self._empty = True
        self._gate = InnovationGate()

    def match(self, predicted: Prediction, scan: StillScan) -> Match:
        points = thinned(scan.points, _INSERTED_CELL)
        registration = ScanRegistration(thinned(points, _MATCHED_CELL).astype(np.float64), scan.sensor, self._map)
        match = self._weigh(predicted, registration)
        if match.accepted:
            match = replace(match, posterior=_with_keyframe(match.posterior))
            state = match.posterior.state
            self._map.confirm(registration.met, registration.close)
            mapped = state.keyframes.mapped(np.vstack([state.placed(points), state.to_world(scan.sensor)]))
            self._map.insert(mapped[:-1], mapped[-1], state.keyframes.newest)
            self._empty = False
        return match

    def _weigh(self, predicted: Prediction, registration: ScanRegistration) -> Match:
        if self._empty:
            return Match(unchanged(predicted), registration.agreement, None)
        posterior = update(predicted.state, predicted.covariance, registration)
        result = self._gate(registration.agreement, predicted.covariance, posterior)
        return Match(unchanged(predicted) if result.rejection else posterior, registration.agreement, result)


def _with_keyframe(posterior: Posterior) -> Posterior:
    """The posterior with another keyframe if one is due; `step` does not include it."""
    state, covariance = posterior.state, posterior.covariance
    if not state.keyframes.is_due(state.position, state.turn):
        return posterior
    keyframes, spread = state.keyframes.with_one_more(state.position, state.turn, covariance)
    return Posterior(replace(state, keyframes=keyframes), spread, posterior.step)
