"""What stands around the drone, as far as the measurements of the last seconds tell: voxels with votes.

Each measurement votes for the voxels in which its points lie and against those that it sees through. So a surface is
known once two measurements agree on it, stays known when it leaves the field of view, and a ghost goes as soon as
somebody looks there again.
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
"""What was not seen again for so long is forgotten [s]: the drone does not know its position better than that."""
AGREEING: Final = 2
"""Votes that make a voxel solid."""
_MOST_VOTES = 6
_HALF_SPAN = 1 << 20


class LocalMap:
    """Solid voxels within `span` metres of the drone, each with the point that was seen in it last; what was not seen
    again for `memory` seconds is forgotten."""

    def __init__(self, span: float = 30.0, memory: float = MEMORY) -> None:
        self._span, self._memory = span, memory
        self._keys: NDArray[np.int64] = np.empty(0, dtype=np.int64)
        # Coordinate by coordinate, (3, N): most of what is asked of all points goes along one axis.
        self._points: Points = np.empty((3, 0))
        self._votes: NDArray[np.int8] = np.empty(0, dtype=np.int8)
        self._stamps: NDArray[np.float64] = np.empty(0)

    def __len__(self) -> int:
        return len(self._keys)

    def solid_within(self, low: Points, high: Points) -> Points:
        """Points (N, 3), in the world [m], of the voxels that are agreed on, in the box from `low` to `high` (3,)."""
        solid = np.flatnonzero(self._within(low, high) & (self._votes >= AGREEING))
        return self._points.take(solid, axis=1).T

    def part(self, low: Points, high: Points) -> LocalMap:
        """What of it lies in the box from `low` to `high` (3,), to be asked often."""
        return self._copy(self._within(low, high), self._memory)

    def forget(self) -> None:
        self.__init__(self._span, self._memory)

    def lately(self, t: float) -> LocalMap:
        """What one would know at `t` that had seen the same, with the usual memory."""
        return self._copy(self._stamps >= t - MEMORY, MEMORY)

    def see(
        self, points: Points, here: Points, stamp: float, sees_through: Callable[[Points], Mask], votes: int = 1
    ) -> None:
        """Take in a measurement that ended at `stamp`: its points (N, 3), taken from about `here` (3,), in the world,
        and what tells which points in the world it saw through. It counts as so many `votes`."""
        keys, first = np.unique(_keys(points), return_index=True)
        at = np.minimum(np.searchsorted(self._keys, keys), max(len(self._keys) - 1, 0))
        known = self._keys[at] == keys if len(self._keys) else np.zeros(len(keys), dtype=bool)
        hit, seen = at[known], first[known]
        self._votes[hit] = np.minimum(self._votes[hit] + votes, _MOST_VOTES)
        self._stamps[hit], self._points[:, hit] = stamp, points[seen].T
        doubted = sees_through(self._points.T)
        doubted[hit] = False
        self._votes[doubted] -= 1
        kept = (self._votes > 0) & (stamp - self._stamps <= self._memory)
        kept &= self._within(here - self._span, here + self._span)
        self._merge(kept, keys[~known], points[first[~known]], stamp, votes)

    def _within(self, low: Points, high: Points) -> Mask:
        """Which points lie in the box from `low` to `high` (3,)."""
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
        """Leave out what is not `kept`, and put new voxels with so many votes between the others."""
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
