"""How well a scan lies on the planes of the map, and which way it would have to move to lie better."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from skillwing.sim_mujoco.slam.filter import Evidence
from skillwing.sim_mujoco.slam.plane_map import PlaneMap
from skillwing.sim_mujoco.slam.so3 import Floats
from skillwing.sim_mujoco.slam.state import State

RANGE_SIGMA = 0.05
"""Of a point about its plane [m]: the sensor's noise and what the world has of unevenness."""
DOUBT = 1.0
WEIGHT = 0.25
"""Of a scan's evidence. Points of one scan err together (a plane wrong by a centimetre is so for all of its points), so
that they say less than as many independent ones."""
_GATES = (0.3, 0.3, 0.15, 0.15)
"""Points farther from their plane than this in each iteration are left out [m]."""


@dataclass(frozen=True, slots=True)
class Agreement:
    """Of so many `points` of a scan some `matched` a plane, of which some were `close` to it; `error` is their median
    distance [m], None where it is not told."""

    points: int
    matched: int
    close: int
    error: float | None

    @property
    def share(self) -> float:
        """Share of the points, 0 to 1, that lie on known planes."""
        return self.close / self.points if self.points else 0.0


class Registration:
    """Compares one scan, as points (N, 3) in body axes, with maps of planes; the first that has one decides."""

    def __init__(self, points: Floats, maps: tuple[PlaneMap, ...]) -> None:
        self._points, self._maps = points, maps
        self.agreement = Agreement(len(points), 0, 0, 0.0)

    def __call__(self, state: State, iteration: int) -> Evidence:
        """The evidence at a state; `agreement` tells afterwards how good it is."""
        in_world = state.placed(self._points)
        open_ = np.ones(len(in_world), dtype=np.bool_)
        information, gradient = np.zeros((6, 6)), np.zeros(6)
        matched = close = 0
        errors: list[Floats] = []
        for planes in self._maps:
            candidates = np.flatnonzero(open_)
            matches = planes.match(in_world[candidates])
            numbers = candidates[matches.points]
            open_[numbers] = False
            variances = RANGE_SIGMA**2 + matches.roughness + DOUBT * matches.doubt
            gate = _GATES[min(iteration, len(_GATES) - 1)] + 3.0 * np.sqrt(matches.roughness)
            near = np.abs(matches.distances) < gate
            matched, close = matched + len(near), close + int(np.count_nonzero(near))
            numbers, normals, distances = numbers[near], matches.normals[near], matches.distances[near]
            variances = variances[near]
            errors.append(np.abs(distances))
            # Cauchy's weights: what does not lie on its plane counts less.
            weights = WEIGHT / (variances + 0.25 * distances**2)
            slopes = np.hstack([normals, np.cross(self._points[numbers], normals @ state.turn)])
            weighted = slopes * weights[:, None]
            information += weighted.T @ slopes
            gradient -= weighted.T @ distances
        every = np.concatenate(errors)
        self.agreement = Agreement(len(in_world), matched, close, float(np.median(every)) if len(every) else 0.0)
        return Evidence(information, gradient)
