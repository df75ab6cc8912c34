"""Space as small planes: in each voxel the plane through the points that were seen there, if they lie on one.

As in VoxelMap (Yuan et al., 2022) and the surfel maps before it, with a dense grid of voxels instead of a hash table:
a bounded site is small, and updates are array operations.

A voxel has room for two planes, each of which is seen from its own side only: the two faces of a wall that is thinner
than a voxel. As a single plane such a wall would seem to move by its thickness whenever the drone comes round it.
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
"""Points that make a plane."""
_MOST = 800
"""After so many points a face takes no more: the map must not follow a drifting drone."""
_REFIT = 1.3
"""A plane is fitted anew when its face has so many times the points of the last fit."""
_NOISE = 0.02
"""Of a point about its plane at least [m]."""
_INDEPENDENT = 60.0
"""So many of a plane's points at most err on their own: neighbours lie on the same unevenness, and were seen from poses
that were wrong alike."""
_FLAT, _WIDE = 0.12, 0.1
"""Standard deviations of a plane's points: across it at most [m], and along it at least, in sides of a voxel."""
LATELY = 50
"""Scans for which a plane that was confirmed stays so: five seconds."""
_ROOM = 8192
_NORMAL, _CENTRE, _LOOSE, _ROUGHNESS, _OFFSET, _TILT = slice(0, 3), slice(3, 6), slice(6, 9), 9, 10, 11
"""Columns of a plane."""
_PAIRS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))


@dataclass(frozen=True, slots=True)
class Matches:
    """Points that lie in voxels with a plane: their numbers (N,), the planes (N,) and their unit normals (N, 3), the
    points' distances from the planes (N,) [m], the planes' roughness (N,) as variances [m2], and the variances (N,) of
    the planes themselves at the points [m2], which grow outward from where a plane was seen. `lately` (N,): whether the
    plane was confirmed within the last scans; `keyframes` (N,): the numbers of those that the planes were laid from.

    A plane's normal is least sure along the way in which its points spread least: `loose` (N, 3) are these unit
    vectors, `tilts` (N,) the variances of the normal along them [rad2], `levers` (N,) how far along them the points
    are from the middle of the plane [m].
    """

    points: NDArray[np.int64]
    planes: NDArray[np.int32]
    normals: Floats
    distances: Floats
    roughness: Floats
    doubt: Floats
    lately: NDArray[np.bool_]
    keyframes: NDArray[np.int64]
    loose: Floats
    tilts: Floats
    levers: Floats


class PlaneMap:
    """Cubic voxels of `size` metres that fill the box from `low` to `high`. What lies outside is not mapped."""

    def __init__(self, low: Vector, high: Vector, size: float) -> None:
        self._size = size
        self._low = np.array(low)
        self._shape = np.ceil((np.array(high) - self._low) / size).astype(np.int64)
        self._count = int(self._shape.prod())
        self._rows = np.full(2 * self._count, -1, dtype=np.int32)
        """Of each face, its row in the table of those of which anything was seen, or -1. Each voxel's first face comes
        before all second ones, which are what is seen from behind the plane of the first."""
        self._used = 0
        self._corners = np.zeros((_ROOM, 3))
        self._sums = np.zeros((_ROOM, 10))
        """Over each face's points: their number, their coordinates from the voxel's corner, and products of these
        (_PAIRS)."""
        self._fitted = np.zeros(_ROOM)
        """How many points there were when the plane was fitted."""
        self._is_plane = np.zeros(_ROOM, dtype=np.bool_)
        self._scans = 0
        """How many were taken in."""
        self._confirmed = np.zeros(_ROOM, dtype=np.int64)
        """Which of them, counted from 1, confirmed the plane last; 0 if none has."""
        self._laying = np.zeros(_ROOM)
        """Over each face's points: the numbers of the keyframes that they were laid from."""
        self._keyframes = np.zeros(_ROOM, dtype=np.int64)
        """The one that the plane was laid from, on the average of its points."""
        self._planes = np.zeros((_ROOM, 12))
        """Normal, towards where it was seen from; centre; the way in which it was seen least far; roughness; and
        variances of offset and tilt."""

    @property
    def planes(self) -> int:
        """How many planes there are."""
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
        doubt = planes[:, _OFFSET] + tilts * np.einsum("ij,ij->i", ways, ways)
        levers = np.einsum("ij,ij->i", loose, ways)
        keyframes, roughness = self._keyframes[matched], planes[:, _ROUGHNESS]
        return Matches(numbers, matched, normals, distances, roughness, doubt, lately, keyframes, loose, tilts, levers)

    def confirm(self, planes: NDArray[np.int32], close: NDArray[np.bool_]) -> None:
        """Points of the scan that is taken in next met these planes (N,), and were close to them or not (N,).

        A plane is confirmed by more points than contradict it: a few are close to a wrong one as well.
        """
        votes = np.bincount(planes, np.where(close, 1.0, -1.0))
        self._confirmed[np.flatnonzero(votes > 0.0)] = self._scans + 1

    def insert(self, points: Floats, sensor: Floats, keyframe: int = -1) -> None:
        """Take in points (N, 3) that were seen from `sensor` (3,), all in the world frame, and laid from the `keyframe`
        of this number."""
        self._scans += 1
        faces, inside = self._faces_at(points, sensor)
        faces = faces[inside]
        self._open(faces)
        rows = self._rows[faces]
        # What is seen again much later is laid from elsewhere, and would blur where the plane was laid from. Of points
        # that have made no plane by then, nothing is left.
        self._forget(rows[~self._is_plane[rows] & (self._laying[rows] <= (keyframe - KEYFRAMES) * self._sums[rows, 0])])
        late = self._is_plane[rows] & (self._keyframes[rows] <= keyframe - KEYFRAMES)
        wanting = np.flatnonzero((self._sums[rows, 0] < _MOST) & ~late)
        if len(wanting):
            self._accumulate(points.take(np.flatnonzero(inside)[wanting], axis=0), rows[wanting], sensor, keyframe)

    def _faces_at(self, points: Floats, sensor: Floats) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        """The faces that points seen from `sensor` belong to, and whether they lie in the box."""
        voxels, inside = self._voxels_at(points)
        rows = self._rows[voxels]
        planes = self._planes[rows]
        heights = np.einsum("ij,ij->i", planes[:, _NORMAL], sensor - planes[:, _CENTRE])
        behind = (rows >= 0) & self._is_plane[rows] & (heights < 0.0)
        return voxels + self._count * behind, inside

    def _open(self, faces: NDArray[np.int64]) -> None:
        """Give those faces a row that have none."""
        new = np.unique(faces[self._rows[faces] < 0])
        first, self._used = self._used, self._used + len(new)
        while self._used > len(self._sums):
            self._corners, self._sums, self._planes = map(_doubled, (self._corners, self._sums, self._planes))
            self._fitted, self._is_plane = _doubled(self._fitted), _doubled(self._is_plane)
            self._confirmed = _doubled(self._confirmed)
            self._laying, self._keyframes = _doubled(self._laying), _doubled(self._keyframes)
        self._rows[new] = np.arange(first, self._used)
        cells = np.stack(np.unravel_index(new % self._count, tuple(self._shape)), axis=-1)
        self._corners[first : self._used] = self._low + cells * self._size

    def _forget(self, rows: NDArray[np.int32]) -> None:
        """Begin these faces anew."""
        for table in (self._sums, self._laying, self._fitted):
            table[rows] = 0.0

    def _accumulate(self, points: Floats, rows: NDArray[np.int32], sensor: Floats, keyframe: int) -> None:
        touched = np.flatnonzero(np.bincount(rows))
        number = len(touched)
        places = np.empty(self._used, dtype=np.int64)
        places[touched] = np.arange(number)
        place = places[rows]
        # Sums are taken from the voxels' corners: far from the origin their squares would lose digits.
        local = points - self._corners[rows]
        terms = [None, *local.T, *(local[:, a] * local[:, b] for a, b in _PAIRS)]
        self._sums[touched] += np.stack([np.bincount(place, term, number) for term in terms], axis=1)
        self._laying[touched] += keyframe * np.bincount(place, None, number)
        counts = self._sums[touched, 0]
        self._fit(touched[(counts >= _FEWEST) & (counts >= _REFIT * self._fitted[touched])], sensor)

    def _fit(self, rows: NDArray[np.int64], sensor: Floats) -> None:
        """Fit planes, which are seen from `sensor`, by the principal axes of the points."""
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
        self._keyframes[rows] = np.rint(self._laying[rows] / counts)
        self._fitted[rows] = counts

    def _voxels_at(self, points: Floats) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        """Flat indices of the points' voxels, and whether they lie in the box; others get index 0."""
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
