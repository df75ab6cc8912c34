"""How a scan is compared with what was seen before: the one part of odometry that may be exchanged."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from skillwing.onboard.frames.vectors import Vector
from skillwing.onboard.odometry.deskew import StillScan, thinned
from skillwing.onboard.odometry.divergence_monitor import Judge, Judgement
from skillwing.onboard.odometry.filter import Posterior, update
from skillwing.onboard.odometry.plane_map import PlaneMap
from skillwing.onboard.odometry.propagation import Prediction
from skillwing.onboard.odometry.registration import Agreement, Registration

VOXEL = 1.0
"""Side of the voxels that hold a plane each [m]."""
_MATCHED_CELL, _INSERTED_CELL = 0.35, 0.12
"""At most one point in each cube of this side is compared with the map, or put into it [m]."""


@dataclass(frozen=True, slots=True)
class Match:
    """What came of a scan: the state after it, how it agrees with the map, and the judgement on it; None for the first
    scan, which has nothing to be compared with."""

    posterior: Posterior
    agreement: Agreement
    judgement: Judgement | None

    @property
    def believed(self) -> bool:
        """Whether the scan was used."""
        return self.judgement is None or not self.judgement.doubt


class Matcher(Protocol):
    """Compares each scan with a map of its own, and then puts it there unless it is doubted."""

    def match(self, predicted: Prediction, scan: StillScan) -> Match: ...


MakeMatcher = Callable[[Vector, Vector], Matcher]
"""Makes a matcher with an empty map of the box between two corners [m]."""


def unchanged(predicted: Prediction) -> Posterior:
    """What is known without a scan."""
    return Posterior(predicted.state, predicted.covariance, np.zeros(len(predicted.covariance)))


class PlaneMatcher:
    """Distances of points from planes, and inertial measurements, weighed against one another in one filter."""

    def __init__(self, low: Vector, high: Vector) -> None:
        self._map = PlaneMap(low, high, VOXEL)
        self._empty = True
        self._judge = Judge()

    def match(self, predicted: Prediction, scan: StillScan) -> Match:
        points = thinned(scan.points, _INSERTED_CELL)
        registration = Registration(thinned(points, _MATCHED_CELL).astype(np.float64), scan.sensor, self._map)
        match = self._weigh(predicted, registration)
        if match.believed:
            match = replace(match, posterior=_with_keyframe(match.posterior))
            state = match.posterior.state
            self._map.confirm(registration.met, registration.close)
            laid = state.keyframes.laid(np.vstack([state.placed(points), state.to_world(scan.sensor)]))
            self._map.insert(laid[:-1], laid[-1], state.keyframes.newest)
            self._empty = False
        return match

    def _weigh(self, predicted: Prediction, registration: Registration) -> Match:
        if self._empty:
            return Match(unchanged(predicted), registration.agreement, None)
        posterior = update(predicted.state, predicted.covariance, registration)
        judgement = self._judge(registration.agreement, predicted.covariance, posterior)
        return Match(unchanged(predicted) if judgement.doubt else posterior, registration.agreement, judgement)


def _with_keyframe(posterior: Posterior) -> Posterior:
    """The same with another keyframe if one is due. What the scan changed does not count it."""
    state, covariance = posterior.state, posterior.covariance
    if not state.keyframes.is_due(state.position, state.turn):
        return posterior
    keyframes, spread = state.keyframes.with_one_more(state.position, state.turn, covariance)
    return Posterior(replace(state, keyframes=keyframes), spread, posterior.step)
