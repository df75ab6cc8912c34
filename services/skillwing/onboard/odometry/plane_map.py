"""Map of planes: in each voxel the plane through its points, if they lie on one.

As in VoxelMap (Yuan et al., 2022) and the surfel maps before it, with a dense grid of voxels instead of a hash table:
a bounded site is small, and updates are array operations.

A voxel has room for two planes, each of which is seen from its own side only: the two faces of a wall that is thinner
than a voxel. As a single plane such a wall would seem to move by its thickness when the drone flies around it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from skillwing.onboard.frames.vectors import Vector
from skillwing.onboard.odometry.keyframes import MOST as KEYFRAMES
from skillwing.onboard.odometry.so3 import Floats

T = TypeVar("T", bound=np.generic)
_FEWEST = 8
"""Fewest points of a plane."""
_MOST = 800
"""Most points of a face: the map must not follow a drifting drone."""
_REFIT = 1.3
"""Growth of a face's number of points after which its plane is fitted again."""
_NOISE = 0.02
"""Least standard deviation of a point about its plane [m]."""
_INDEPENDENT = 60.0
"""Most points of a plane that count as independent: neighbours share the unevenness of the surface and the error of the
pose."""
_FLAT, _WIDE = 0.12, 0.1
"""Largest standard deviation of a plane's points across it [m], and least one along it, in sides of a voxel."""
LATELY = 50
"""Scans for which a confirmation of a plane is valid: five seconds."""
_ROOM = 8192
_NORMAL, _CENTRE, _LOOSE, _ROUGHNESS, _OFFSET, _TILT = slice(0, 3), slice(3, 6), slice(6, 9), 9, 10, 11
"""Columns of a plane."""
_PAIRS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))


@dataclass(frozen=True, slots=True)
class Matches:
    """Points in voxels with a plane: their numbers (N,), the planes (N,) and their unit normals (N, 3).

    `distances` (N,) are those of the points from the planes [m], `roughness` (N,) the variances of the planes' points
    [m2]. `plane_variances` (N,) are those of the planes at the points [m2], which grow outward from a plane's centre.
    `lately` (N,): the plane was confirmed within the last scans. `keyframes` (N,): numbers of the keyframes that the
    planes were mapped from.

    A plane's normal is least certain along the direction in which its points spread least. `loose` (N, 3) are these
    unit vectors, and `tilts` (N,) the variances of the normal along them [rad2]. `levers` (N,) are the points'
    distances along them from the middle of the plane [m].
    """

    points: NDArray[np.int64]
    planes: NDArray[np.int32]
    normals: Floats
    distances: Floats
    roughness: Floats
    plane_variances: Floats
    lately: NDArray[np.bool_]
    keyframes: NDArray[np.int64]
    loose: Floats
    tilts: Floats
    levers: Floats


class PlaneMap:
    """Cubic voxels of `size` metres that fill the box from `low` to `high`. Points outside are not mapped."""

    def __init__(self, low: Vector, high: Vector, size: float) -> None:
        self._size = size
        self._low = np.array(low)
        self._shape = np.ceil((np.array(high) - self._low) / size).astype(np.int64)
        self._count = int(self._shape.prod())
        self._rows = np.full(2 * self._count, -1, dtype=np.int32)
        """Row of each face in the tables, or -1 for a face without points. The first faces of all voxels come before
        all second ones, which are seen from behind the plane of the first."""
        self._used = 0
        self._corners = np.zeros((_ROOM, 3))
        self._sums = np.zeros((_ROOM, 10))
        """Sums over each face's points: their number, their coordinates from the voxel's corner, and products of these
        (_PAIRS)."""
        self._fitted = np.zeros(_ROOM)
        """Number of points at the last fit of the plane."""
        self._is_plane = np.zeros(_ROOM, dtype=np.bool_)
        self._scans = 0
        """Number of scans inserted."""
        self._confirmed = np.zeros(_ROOM, dtype=np.int64)
        """Number of the scan, from 1, that confirmed the plane last; 0 for none."""
        self._keyframe_sums = np.zeros(_ROOM)
        """Sums over each face's points: the numbers of the keyframes that they were mapped from."""
        self._keyframes = np.zeros(_ROOM, dtype=np.int64)
        """Number of the keyframe that the plane was mapped from, as the mean over its points."""
        self._planes = np.zeros((_ROOM, 12))
        """Normal, towards the sensor; centre; direction of the least spread; roughness; variances of offset and
        tilt."""

    @property
    def planes(self) -> int:
        """Number of planes."""
        return int(np.count_nonzero(self._is_plane))

    def match(self, points: Floats, sensor: Floats) -> Matches:
        """Compare points (N, 3) with the planes of their voxels that face the `sensor` (3,), all in the world frame."""
        faces, inside = self._faces_at(points, sensor)
        rows = self._rows[faces]
        numbers = np.flatnonzero(inside & (rows >= 0) & self._is_plane[rows])
        matched = rows[numbers]
        planes, lately = self._planes[matched], self._confirmed[matched] > max(self._scans - LATELY, 0)
        normals, ways = planes[:, _NORMAL], points[numbers] - planes[:, _CENTRE]
        distances = np.einsum("ij,ij->i", normals, ways)
        loose, tilts = planes[:, _LOOSE], planes[:, _TILT]
        variances = planes[:, _OFFSET] + tilts * np.einsum("ij,ij->i", ways, ways)
        levers = np.einsum("ij,ij->i", loose, ways)
        keyframes, roughness = self._keyframes[matched], planes[:, _ROUGHNESS]
        return Matches(
            numbers, matched, normals, distances, roughness, variances, lately, keyframes, loose, tilts, levers
        )

    def confirm(self, planes: NDArray[np.int32], close: NDArray[np.bool_]) -> None:
        """Confirm planes (N,) by points of the scan to be inserted next, which are close to them or not (N,).

        More points have to confirm a plane than contradict it: a few are close to a wrong one as well.
        """
        votes = np.bincount(planes, np.where(close, 1.0, -1.0))
        self._confirmed[np.flatnonzero(votes > 0.0)] = self._scans + 1

    def insert(self, points: Floats, sensor: Floats, keyframe: int = -1) -> None:
        """Insert points (N, 3) seen from `sensor` (3,), all in the world frame, and mapped from the `keyframe` of this
        number."""
        self._scans += 1
        faces, inside = self._faces_at(points, sensor)
        faces = faces[inside]
        self._open(faces)
        rows = self._rows[faces]
        # Points seen much later are mapped from another keyframe, and would blur the plane's one. Old points that have
        # made no plane by then are dropped.
        self._forget(
            rows[~self._is_plane[rows] & (self._keyframe_sums[rows] <= (keyframe - KEYFRAMES) * self._sums[rows, 0])]
        )
        late = self._is_plane[rows] & (self._keyframes[rows] <= keyframe - KEYFRAMES)
        wanting = np.flatnonzero((self._sums[rows, 0] < _MOST) & ~late)
        if len(wanting):
            self._accumulate(points.take(np.flatnonzero(inside)[wanting], axis=0), rows[wanting], sensor, keyframe)

    def _faces_at(self, points: Floats, sensor: Floats) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        """Faces of points seen from `sensor`, and a mask of those inside the box."""
        voxels, inside = self._voxels_at(points)
        rows = self._rows[voxels]
        planes = self._planes[rows]
        heights = np.einsum("ij,ij->i", planes[:, _NORMAL], sensor - planes[:, _CENTRE])
        behind = (rows >= 0) & self._is_plane[rows] & (heights < 0.0)
        return voxels + self._count * behind, inside

    def _open(self, faces: NDArray[np.int64]) -> None:
        """Give a row to the faces without one."""
        new = np.unique(faces[self._rows[faces] < 0])
        first, self._used = self._used, self._used + len(new)
        while self._used > len(self._sums):
            self._corners, self._sums, self._planes = map(_doubled, (self._corners, self._sums, self._planes))
            self._fitted, self._is_plane = _doubled(self._fitted), _doubled(self._is_plane)
            self._confirmed = _doubled(self._confirmed)
            self._keyframe_sums, self._keyframes = _doubled(self._keyframe_sums), _doubled(self._keyframes)
        self._rows[new] = np.arange(first, self._used)
        cells = np.stack(np.unravel_index(new % self._count, tuple(self._shape)), axis=-1)
        self._corners[first : self._used] = self._low + cells * self._size

    def _forget(self, rows: NDArray[np.int32]) -> None:
        """Clear these faces."""
        for table in (self._sums, self._keyframe_sums, self._fitted):
            table[rows] = 0.0

    def _accumulate(self, points: Floats, rows: NDArray[np.int32], sensor: Floats, keyframe: int) -> None:
        touched = np.flatnonzero(np.bincount(rows))
        number = len(touched)
        places = np.empty(self._used, dtype=np.int64)
        places[touched] = np.arange(number)
        place = places[rows]
        # Sums are relative to the voxels' corners: far from the origin their squares would lose digits.
        local = points - self._corners[rows]
        terms = [None, *local.T, *(local[:, a] * local[:, b] for a, b in _PAIRS)]
        self._sums[touched] += np.stack([np.bincount(place, term, number) for term in terms], axis=1)
        self._keyframe_sums[touched] += keyframe * np.bincount(place, None, number)
        counts = self._sums[touched, 0]
        self._fit(touched[(counts >= _FEWEST) & (counts >= _REFIT * self._fitted[touched])], sensor)

    def _fit(self, rows: NDArray[np.int64], sensor: Floats) -> None:
        """Fit planes, seen from `sensor`, by the principal axes of their points."""
        counts = self._sums[rows, 0]
        means = self._sums[rows, 1:] / counts[:, None]
        scatter = np.empty((len(rows), 3, 3))
        for column, (a, b) in enumerate(_PAIRS, start=3):
            scatter[:, a, b] = scatter[:, b, a] = means[:, column] - means[:, a] * means[:, b]
        spreads, axes = np.linalg.eigh(scatter)
        thin, middle = np.maximum(spreads[:, 0], 0.0), spreads[:, 1]
        # Thin in one direction, wide in the two others: neither a lump nor a line.
        flat = (thin < _FLAT**2) & (thin < 0.15 * middle)
        self._is_plane[rows] = flat & (middle > (_WIDE * self._size) ** 2)
        centres = self._corners[rows] + means[:, :3]
        offsets = np.maximum(thin, _NOISE**2) / np.minimum(counts, _INDEPENDENT)
        tilts = offsets / np.maximum(middle, 1e-6)
        normals = axes[:, :, 0]
        normals *= np.copysign(1.0, np.einsum("ij,ij->i", normals, sensor - centres))[:, None]
        self._planes[rows] = np.column_stack([normals, centres, axes[:, :, 1], thin, offsets, tilts])
        self._keyframes[rows] = np.rint(self._keyframe_sums[rows] / counts)
        self._fitted[rows] = counts

    def _voxels_at(self, points: Floats) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        """Flat indices of the points' voxels, and a mask of those inside the box; others get index 0."""
        flat = np.zeros(len(points), dtype=np.int64)
        inside = np.ones(len(points), dtype=np.bool_)
        for values, low, count in zip(points.T, self._low, self._shape.tolist(), strict=True):
            cells = np.floor((values - low) * (1.0 / self._size))
            inside &= (cells >= 0.0) & (cells < count)
            flat = flat * count + cells.astype(np.int64)
        return np.where(inside, flat, 0), inside


def _doubled(table: NDArray[T]) -> NDArray[T]:
    """The table with as many rows again, of zeros."""
    return np.concatenate([table, np.zeros_like(table)])
