"""A picture from a part of its rays: what lies between two pixels of one surface lies on it too, the rest is cast.

The same thought as for the depth camera (`sensors/infill.py`), but it goes by what was hit instead of by straight
lines, because the colour of a pixel needs to know that anyway.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Pixels = NDArray[np.int64]
Floats = NDArray[np.float32]
Faces = NDArray[np.int32]
Cast = Callable[[Pixels, Pixels], tuple[Floats, Faces]]
"""Inverse ranges (n,) and faces (n,), -1 for the sky, of the pixels in these rows and columns."""


def trace(height: int, width: int, surface_of: NDArray[np.int32], cast: Cast) -> tuple[Floats, Faces]:
    """Inverse distances along the optical axis and faces (height, width); both measures are even.

    `surface_of` gives the surface that a face belongs to, and that of the sky as its last element.
    """
    rows, columns = np.meshgrid(np.arange(0, height, 2), np.arange(0, width, 2), indexing="ij")
    inverse, face = cast(rows.ravel(), columns.ravel())
    known = inverse.reshape(rows.shape), face.reshape(rows.shape)
    wide = _fill(*known, surface_of, lambda i, j: cast(2 * i, j))
    inverse, face = _fill(wide[0].T, wide[1].T, surface_of, lambda i, j: cast(j, i))
    return np.ascontiguousarray(inverse.T), np.ascontiguousarray(face.T)


def _fill(inverse: Floats, face: Faces, surface_of: NDArray[np.int32], cast: Cast) -> tuple[Floats, Faces]:
    """Put a column after each column of both (n, m): (n, 2 m)."""
    rows, columns = inverse.shape
    wide_inverse = np.empty((rows, 2 * columns), dtype=np.float32)
    wide_face = np.empty((rows, 2 * columns), dtype=np.int32)
    wide_inverse[:, ::2], wide_face[:, ::2] = inverse, face
    wide_inverse[:, 1:-1:2] = np.float32(0.5) * (inverse[:, :-1] + inverse[:, 1:])
    wide_face[:, 1:-1:2] = face[:, :-1]
    surface = surface_of[face]
    unknown = np.ones((rows, columns), dtype=bool)
    unknown[:, :-1] = surface[:, :-1] != surface[:, 1:]
    i, j = np.nonzero(unknown)
    wide_inverse[i, 2 * j + 1], wide_face[i, 2 * j + 1] = cast(i, 2 * j + 1)
    return wide_inverse, wide_face
