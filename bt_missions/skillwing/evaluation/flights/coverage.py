"""Map coverage: the share of the surface visible from the planned route that a map holds, by the ground truth.

Points are spread evenly over the true triangles. Those in line of sight of the planned route count. They depend on the
world and the route alone, so that flights with and without faults are judged by the same points.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from skillwing.evaluation.flights.saved_map import SavedMap
from skillwing.onboard.frames.vectors import Vector
from skillwing.sim_mujoco.world.rays import RayScene
from skillwing.sim_mujoco.world.triangles import Triangles
from skillwing.sim_mujoco.world.world import BUILDING, TERRAIN, World

STEP = 0.2
"""One point for each square of this side [m]."""
RANGE = 25.0
"""Range of sight from the route [m]."""
VIEWPOINT_SPACING = 1.5
"""Distance of viewpoints on the route [m]."""
_GRAZE = 0.03
_SEED = 20


@dataclass(frozen=True, slots=True)
class Observable:
    """Points (N, 3) on surfaces that can be seen from a route, and their labels (N,)."""

    points: NDArray[np.float32]
    labels: NDArray[np.int8]


@dataclass(frozen=True, slots=True)
class MapQuality:
    """Shares of the observable surface that are mapped, 0 to 1; None where a world has nothing of the kind.

    error: median distance from an occupied voxel's centre to the true surface, as a measure of the map's own
    accuracy [m]; None for an empty map.
    """

    all: float | None
    buildings: float | None
    terrain: float | None
    error: float | None


class CoverageJudge:
    """Ground-truth judge of maps of one world along one planned route."""

    def __init__(self, world: World, route: Sequence[Vector]) -> None:
        triangles = world.triangles()
        self.observable = observable_from(triangles, route)
        everything, _ = triangles.sample(STEP, np.random.default_rng(_SEED))
        self._surface = KDTree(everything)

    def coverage(self, centres: NDArray[np.float32], voxel_size: float) -> MapQuality:
        """Judge a map by the centres (N, 3) of its occupied voxels.

        A point is mapped if an occupied voxel's centre lies within half a voxel's diagonal (0.35 m for voxels of
        0.4 m): a point inside an occupied voxel always counts, one in its empty neighbour only if it is as close.
        """
        points, labels = self.observable.points, self.observable.labels
        if len(centres) == 0:
            mapped, error = np.zeros(len(points), dtype=bool), None
        else:
            reach = math.sqrt(3.0) / 2.0 * voxel_size
            distances, _ = KDTree(centres).query(points, distance_upper_bound=reach * (1.0 + 1e-6))
            mapped = np.isfinite(distances)
            error = float(np.median(self._surface.query(centres)[0]))
        return MapQuality(
            all=_share(mapped),
            buildings=_share(mapped[labels == BUILDING]),
            terrain=_share(mapped[labels == TERRAIN]),
            error=error,
        )


def observable_from(triangles: Triangles, route: Sequence[Vector]) -> Observable:
    """The points on the triangles that are in line of sight within 25 m from viewpoints along the route."""
    points, labels = triangles.sample(STEP, np.random.default_rng(_SEED))
    rays = RayScene(triangles)
    seen = np.zeros(len(points), dtype=bool)
    for viewpoint in _viewpoints(route):
        ways = points - viewpoint
        squares = np.einsum("ij,ij->i", ways, ways)
        candidates = np.flatnonzero(~seen & (squares < RANGE**2) & (squares > 0.0))
        distances = np.sqrt(squares[candidates])
        hits = rays.distances(viewpoint, ways[candidates] / distances[:, None], RANGE + 1.0)
        seen[candidates] = (hits == 0.0) | (hits > distances - _GRAZE)
    return Observable(points[seen], labels[seen])


def _viewpoints(route: Sequence[Vector]) -> NDArray[np.float32]:
    """Points (N, 3) along the legs of a route."""
    stretches = [np.array(route[:1])]
    for a, b in pairwise(route):
        count = max(1, math.ceil(math.dist(a, b) / VIEWPOINT_SPACING))
        stretches.append(np.linspace(a, b, count + 1)[1:])
    return np.concatenate(stretches).astype(np.float32)


def _share(mapped: NDArray[np.bool_]) -> float | None:
    return float(mapped.mean()) if len(mapped) else None


class MapCoverage(NamedTuple):
    """Mapped shares of the observable surface, 0 to 1; None without a map or without truth."""

    all: float | None = None
    buildings: float | None = None
    terrain: float | None = None


def judge_map(world: World, route: Sequence[Vector], saved: SavedMap | None) -> MapCoverage:
    """Coverage of a flight's map, rounded for the report; without a map all shares are None."""
    if saved is None:
        return MapCoverage()
    judged = CoverageJudge(world, route).coverage(saved.centres, saved.voxel_size)
    return MapCoverage(all=_rounded(judged.all), buildings=_rounded(judged.buildings), terrain=_rounded(judged.terrain))


def _rounded(share: float | None) -> float | None:
    return None if share is None else round(share, 4)
