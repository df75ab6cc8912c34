"""Occupancy grid: a dense voxel grid of log-odds, updated with hits and with the free rays before them.

After Moravec and Elfes (1985), with the update constants and clamping of Hornung et al., OctoMap (2013). A dense
int8 array over a bounded box replaces the tree: a courtyard is a few megabytes, and updates are array operations.
"""

from __future__ import annotations

import math
import operator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from skillwing.onboard.frames.vectors import Vector

Voxels = NDArray[np.int64]
"""Voxels by their index in the flattened array; sets of voxels are ascending."""

# Log-odds in steps of 0.05: probability 0.7 for a hit, 0.45 for a miss, clamped to 0.12 .. 0.97. A miss weighs little,
# because rays that graze a wall or the ground go through many voxels that hold a part of it.
_HIT, _MISS = 17, -4
_LOWEST, _HIGHEST = -40, 70
_OCCUPIED = 20
"""Threshold: one hit more than the rays through the voxel."""
_ENOUGH = 50
_FREE = -24
"""Threshold: rays of six scans more than the hits make up for."""


@dataclass(frozen=True, slots=True)
class Fit:
    """Numbers of the voxels that a scan hit: known as occupied before (`confirmed`), or as free (`contradicted`)."""

    confirmed: int
    contradicted: int

    @property
    def mismatch(self) -> float:
        """Share of the contradicted among the known voxels, 0 to 1; 0 while too few are known."""
        known = self.confirmed + self.contradicted
        return self.contradicted / known if known >= _ENOUGH else 0.0


@dataclass(frozen=True, slots=True)
class OccupancyChange:
    """Voxels that have become occupied or free, and all that are `occupied` now."""

    appeared: Voxels
    vanished: Voxels
    occupied: Voxels


class OccupancyGrid:
    """Cubic voxels of `size` metres that fill the box from `low` to `high`. Points outside are not mapped."""

    def __init__(self, low: Vector, high: Vector, size: float = 0.4) -> None:
        self.size = size
        self._low = np.array(low)
        self._shape = np.array(grid_shape(low, high, size))
        self._log_odds = np.zeros(int(self._shape.prod()), dtype=np.int8)
        self._raised: list[Voxels] = []
        """Voxels that hits have made occupied, with repetitions; some are free again."""

    def hit_by(self, points: NDArray[np.float32]) -> Voxels:
        """The voxels with any of these points (N, 3), world frame."""
        return _once_each(self._voxels_at(points.T))

    def fit(self, hits: Voxels) -> Fit:
        """Compare the voxels that a scan hit with the map.

        A free voxel beside an occupied one is no contradiction: most rays miss a surface that hardly reaches into a
        voxel, and some hit it.
        """
        known = self._log_odds[hits]
        free = hits[known <= _FREE]
        confirmed = int(np.count_nonzero(known > _OCCUPIED))
        return Fit(confirmed, len(free) - int(np.count_nonzero(self._touches_occupied(free))))

    def integrate(self, origin: NDArray[np.float64], hits: Voxels) -> None:
        """Integrate the voxels that a scan hit from `origin` (3,), and the rays before them.

        A voxel counts once for each scan: as hit, or else as free if a ray goes through it.
        """
        passed = self._voxels_at(self._along_rays(origin, self._centres64(hits)))
        before = self._log_odds[hits]
        # All of a voxel's duplicates write the same value here, so it is lowered once.
        self._log_odds[passed] = np.maximum(self._log_odds[passed] + np.int8(_MISS), _LOWEST)
        after = np.minimum(before + np.int8(_HIT), _HIGHEST)
        self._log_odds[hits] = after
        self._raised.append(hits[(before <= _OCCUPIED) & (after > _OCCUPIED)])

    def clear(self) -> None:
        """Clear the grid."""
        self._log_odds.fill(0)
        self._raised.clear()

    def occupied(self) -> Voxels:
        """The occupied voxels, searched among those that ever were: few of a box's millions are hit."""
        raised = _once_each(np.concatenate([np.empty(0, dtype=np.int64), *self._raised]))
        occupied = raised[self._log_odds[raised] > _OCCUPIED]
        self._raised = [occupied]
        return occupied

    def count_occupied(self) -> int:
        """Number of occupied voxels."""
        return len(self.occupied())

    def centres(self, voxels: Voxels) -> NDArray[np.float32]:
        """Centres (N, 3) of voxels [m], world frame."""
        return self._centres64(voxels).astype(np.float32)

    def occupied_centres(self) -> NDArray[np.float32]:
        """Centres (N, 3) of the occupied voxels [m]."""
        return self.centres(self.occupied())

    def changed_since(self, before: Voxels) -> OccupancyChange:
        """Changes since `occupied()` was `before`."""
        now = self.occupied()
        appeared = np.setdiff1d(now, before, assume_unique=True)
        return OccupancyChange(appeared, np.setdiff1d(before, now, assume_unique=True), now)

    def _touches_occupied(self, voxels: Voxels) -> NDArray[np.bool_]:
        """Mask of the voxels with an occupied one among their six neighbours."""
        along_x, along_y = self._shape[1] * self._shape[2], self._shape[2]
        offsets = np.array([-along_x, along_x, -along_y, along_y, -1, 1])
        neighbours = np.clip(voxels[:, None] + offsets, 0, len(self._log_odds) - 1)
        return self._log_odds[neighbours].max(axis=1) > _OCCUPIED

    def _along_rays(self, origin: NDArray[np.float64], ends: NDArray[np.float64]) -> NDArray[np.float32]:
        """Samples (3, M) one voxel apart on the rays from `origin`, up to two voxels before each of the ends."""
        ways = ends - origin
        lengths = np.linalg.norm(ways, axis=1)
        counts = np.maximum((lengths / self.size - 1.0).astype(np.int64), 0)
        first = np.cumsum(counts) - counts
        number = (np.arange(int(counts.sum())) - np.repeat(first, counts)).astype(np.float32)
        steps = (ways * (self.size / np.maximum(lengths, self.size))[:, None]).astype(np.float32)
        return np.stack([np.repeat(steps[:, axis], counts) * number + np.float32(origin[axis]) for axis in range(3)])

    def _voxels_at(self, coordinates: NDArray[np.float32]) -> Voxels:
        """The voxels of the points, given as (3, N), inside the box. Axis by axis, this is much faster."""
        voxels = np.zeros(coordinates.shape[1], dtype=np.int64)
        inside = np.ones(coordinates.shape[1], dtype=np.bool_)
        for values, low, count in zip(coordinates, self._low, self._shape, strict=True):
            cells = np.floor((values - np.float32(low)) * np.float32(1.0 / self.size))
            inside &= (cells >= 0.0) & (cells < count)
            voxels = voxels * count + cells.astype(np.int64)
        return voxels[inside]

    def _centres64(self, voxels: Voxels) -> NDArray[np.float64]:
        cells = np.stack(np.unravel_index(voxels, tuple(self._shape)), axis=-1)
        return (cells.astype(np.float64) + 0.5) * self.size + self._low


def _once_each(voxels: Voxels) -> Voxels:
    """The voxels without repetitions, ascending. Sorting, unlike numpy's `unique`, needs no table of hashes."""
    ascending = np.sort(voxels)
    return ascending[np.flatnonzero(np.diff(ascending, prepend=-1))]


def grid_shape(low: Vector, high: Vector, size: float) -> tuple[int, ...]:
    """Numbers of a box's voxels along x, y and z. Raises ValueError for a box or a voxel without a volume."""
    if not all(map(math.isfinite, (*low, *high, size))) or size <= 0.0 or any(map(operator.ge, low, high)):
        raise ValueError("the box and its voxels need a finite volume")
    return tuple(math.ceil((b - a) / size - 1e-9) for a, b in zip(low, high, strict=True))
