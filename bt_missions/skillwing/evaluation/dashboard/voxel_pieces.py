"""A map that grows and shrinks, in pieces that are small enough to be drawn again whenever they change."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

_BITS = 20
"""A cell's three indices are packed into one integer, with this many bits each: a million cells either way."""
_ZERO = 1 << (_BITS - 1)
_MASK = (1 << _BITS) - 1


class VoxelPieces:
    """Occupied voxels in pieces of at most `capacity`, in the order in which they were found.

    Voxels change around the drone, and those are in the latest pieces. So few pieces change at a time.
    """

    def __init__(self, voxel_size: float, capacity: int = 500) -> None:
        self.size = voxel_size
        self._capacity = capacity
        self._known: NDArray[np.int64] = np.empty(0, np.int64)
        self._piece_of: dict[int, int] = {}
        self._pieces: list[dict[int, None]] = []

    def __len__(self) -> int:
        """Voxels in all pieces."""
        return len(self._known)

    @property
    def pieces(self) -> set[int]:
        """Numbers of all pieces."""
        return set(range(len(self._pieces)))

    def add(self, centres: NDArray[np.float32]) -> set[int]:
        """Add voxels by points in them (n, 3), known ones or new; returns the numbers of the pieces that changed."""
        return self._add(self._cells(centres))

    def replace(self, centres: NDArray[np.float32]) -> set[int]:
        """Make the map consist of exactly these voxels; returns the numbers of the pieces that changed."""
        cells = self._cells(centres)
        changed: set[int] = set()
        for cell in np.setdiff1d(self._known, cells, assume_unique=True).tolist():
            piece = self._piece_of.pop(cell)
            del self._pieces[piece][cell]
            changed.add(piece)
        self._known = np.intersect1d(self._known, cells, assume_unique=True)
        return changed | self._add(cells)

    def centres(self, piece: int) -> NDArray[np.float32]:
        """Voxel centres (n, 3) of one piece; n may have become 0."""
        cells = np.fromiter(self._pieces[piece], np.int64, len(self._pieces[piece]))
        indices = np.stack([cells >> 2 * _BITS, cells >> _BITS & _MASK, cells & _MASK], axis=1) - _ZERO
        return ((indices + 0.5) * self.size).astype(np.float32)

    def _add(self, cells: NDArray[np.int64]) -> set[int]:
        changed: set[int] = set()
        fresh = np.setdiff1d(cells, self._known, assume_unique=True)
        for cell in fresh.tolist():
            if not self._pieces or len(self._pieces[-1]) >= self._capacity:
                self._pieces.append({})
            self._piece_of[cell] = len(self._pieces) - 1
            self._pieces[-1][cell] = None
            changed.add(len(self._pieces) - 1)
        self._known = np.union1d(self._known, fresh)
        return changed

    def _cells(self, centres: NDArray[np.float32]) -> NDArray[np.int64]:
        """Packed cells, sorted and each once."""
        x, y, z = np.floor(centres / self.size).astype(np.int64).T + _ZERO
        return np.unique(x << 2 * _BITS | y << _BITS | z)
