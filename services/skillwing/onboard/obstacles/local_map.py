"""Local map of obstacles around the drone, from the measurements of the last seconds: voxels with votes.

Each measurement votes for the voxels with its points, and against those that it sees through. So a surface is known
once two measurements agree on it, and stays known outside the field of view. A false point disappears at the next look.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.float64]
Mask = NDArray[np.bool_]

VOXEL: Final = 0.3
"""Side of a voxel [m]."""
MEMORY: Final = 20.0
"""Time after which a voxel that was not seen again is dropped, because the drone's position drifts [s]."""
AGREEING: Final = 2
"""Votes that make a voxel solid."""
_MOST_VOTES = 6
_HALF_SPAN = 1 << 20


class LocalMap:
    """Voxels within `span` metres of the drone, each with the point seen in it last. A voxel that was not seen again
    for `memory` seconds is dropped."""

    def __init__(self, span: float = 30.0, memory: float = MEMORY) -> None:
        self._span, self._memory = span, memory
        self._keys: NDArray[np.int64] = np.empty(0, dtype=np.int64)
        # Coordinate by coordinate, (3, N): most operations on all points are along one axis.
        self._points: Points = np.empty((3, 0))
        self._votes: NDArray[np.int8] = np.empty(0, dtype=np.int8)
        self._stamps: NDArray[np.float64] = np.empty(0)

    def __len__(self) -> int:
        return len(self._keys)

    def solid_within(self, low: Points, high: Points) -> Points:
        """Points (N, 3), in the world [m], of the solid voxels in the box from `low` to `high` (3,)."""
        solid = np.flatnonzero(self._within(low, high) & (self._votes >= AGREEING))
        return self._points.take(solid, axis=1).T

    def part(self, low: Points, high: Points) -> LocalMap:
        """The part in the box from `low` to `high` (3,), for many queries."""
        return self._copy(self._within(low, high), self._memory)

    def forget(self) -> None:
        self.__init__(self._span, self._memory)

    def lately(self, t: float) -> LocalMap:
        """The map at `t` as it would be with the usual memory."""
        return self._copy(self._stamps >= t - MEMORY, MEMORY)

    def see(
        self, points: Points, here: Points, stamp: float, sees_through: Callable[[Points], Mask], votes: int = 1
    ) -> None:
        """Take a measurement that ended at `stamp`: its points (N, 3) in the world, taken from about `here` (3,).

        `sees_through` gives the mask of points in the world that it saw through. It counts as so many `votes`.
        """
        keys, first = np.unique(_keys(points), return_index=True)
        at = np.minimum(np.searchsorted(self._keys, keys), max(len(self._keys) - 1, 0))
        known = self._keys[at] == keys if len(self._keys) else np.zeros(len(keys), dtype=bool)
        hit, seen = at[known], first[known]
        self._votes[hit] = np.minimum(self._votes[hit] + votes, _MOST_VOTES)
        self._stamps[hit], self._points[:, hit] = stamp, points[seen].T
        passed = sees_through(self._points.T)
        passed[hit] = False
        self._votes[passed] -= 1
        kept = (self._votes > 0) & (stamp - self._stamps <= self._memory)
        kept &= self._within(here - self._span, here + self._span)
        self._merge(kept, keys[~known], points[first[~known]], stamp, votes)

    def _within(self, low: Points, high: Points) -> Mask:
        """Mask of the points in the box from `low` to `high` (3,)."""
        inside = np.ones(len(self), dtype=np.bool_)
        for along, least, most in zip(self._points, low, high, strict=True):
            inside &= (along >= least) & (along <= most)
        return inside

    def _copy(self, wanted: Mask, memory: float) -> LocalMap:
        copy, at = LocalMap(self._span, memory), np.flatnonzero(wanted)
        copy._keys, copy._points = self._keys[at], self._points.take(at, axis=1)
        copy._votes, copy._stamps = self._votes[at], self._stamps[at]
        return copy

    def _merge(self, kept: Mask, keys: NDArray[np.int64], points: Points, stamp: float, votes: int) -> None:
        """Drop voxels that are not `kept`, and insert new ones with so many votes in order."""
        old, new = np.flatnonzero(kept), len(self._keys) + np.arange(len(keys))
        order = np.argsort(np.concatenate([self._keys[old], keys]), kind="stable")
        source = np.concatenate([old, new])[order]
        self._keys = np.concatenate([self._keys, keys])[source]
        self._points = np.concatenate([self._points, points.T], axis=1).take(source, axis=1)
        self._votes = np.concatenate([self._votes, np.full(len(keys), votes, dtype=np.int8)])[source]
        self._stamps = np.concatenate([self._stamps, np.full(len(keys), stamp)])[source]


def _keys(points: Points) -> NDArray[np.int64]:
    """One number for each point's voxel."""
    cells = np.floor(points / VOXEL).astype(np.int64)
    cells = np.clip(cells, -_HALF_SPAN, _HALF_SPAN - 1) + _HALF_SPAN
    return (cells[:, 0] << 42) | (cells[:, 1] << 21) | cells[:, 2]
