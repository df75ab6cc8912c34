"""A picture from a part of its rays: what lies between two pixels of one surface lies on it too, the rest is cast.

The same thought as for the depth camera (`sensors/infill.py`), but it goes by what was hit instead of by straight
lines, because the colour of a pixel needs to know that anyway.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Pixels = NDArray[np.intp]
Floats = NDArray[np.float32]
Faces = NDArray[np.int32]
Cast = Callable[[Pixels], tuple[Floats, Faces]]
"""Inverse distances along the optical axis (n,) and faces (n,), -1 for the sky, of the pixels with these numbers,
counted row by row."""


def trace(height: int, width: int, surface_of: NDArray[np.int32], cast: Cast) -> tuple[Floats, Faces]:
    """Inverse distances along the optical axis and faces (height, width); both measures are even.

    `surface_of` gives the surface that a face belongs to, and that of the sky as its last element.
    """
    pixels = np.arange(height * width, dtype=np.intp).reshape(height, width)
    inverse, face = np.empty(pixels.shape, dtype=np.float32), np.empty(pixels.shape, dtype=np.int32)

    def cast_into(chosen: Pixels) -> None:
        inverse.reshape(-1)[chosen], face.reshape(-1)[chosen] = cast(chosen)

    cast_into(pixels[::2, ::2].ravel())
    # First the columns between those of every other row, then the other rows.
    cast_into(pixels[::2, 1::2].T[_fill(inverse[::2].T, face[::2].T, surface_of)])
    cast_into(pixels[1::2][_fill(inverse, face, surface_of)])
    return inverse, face


def _fill(inverse: Floats, face: Faces, surface_of: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Fill in every other row of both (2 n, m) from those before and after it, and tell where (n, m) of these rows that
    does not hold, because there is another surface on either side."""
    known = face[::2]
    inverse[1:-1:2] = np.float32(0.5) * (inverse[:-2:2] + inverse[2::2])
    face[1::2] = known
    surface = surface_of.take(known)
    unknown = np.ones(surface.shape, dtype=np.bool_)
    np.not_equal(surface[:-1], surface[1:], out=unknown[:-1])
    return unknown
