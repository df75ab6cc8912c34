"""A picture from a quarter of its rays: what lies on a plane between known pixels is computed, the rest is cast.

On a plane the inverse of the depth is a linear function of the pixel's place. Where four known neighbours in a row lie
on one line, the pixel in their middle lies on it too; edges, silhouettes and curved surfaces break the line and get a
ray of their own. What is thinner than two pixels may be missed.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Pixels = NDArray[np.intp]
Image = NDArray[np.float32]
Cast = Callable[[Pixels], Image]
"""Inverse depths (n,) of the pixels with these numbers, counted row by row."""

_STRAIGHT = np.float32(2e-3)
"""How far, relative to the value, neighbours may lie off one line."""


class Infill:
    """Computes pictures of one size, of which both sides are even."""

    def __init__(self, height: int, width: int) -> None:
        self._numbers = np.arange(height * width, dtype=np.intp).reshape(height, width)
        self._first = self._numbers[::2, ::2].ravel()
        self._between_columns = np.ascontiguousarray(self._numbers[::2, 1::2])
        self._between_rows = np.ascontiguousarray(self._numbers[1::2].T)

    def inverse_depths(self, cast: Cast) -> Image:
        """Inverse depths (height, width); 0 where there is no return."""
        known = cast(self._first).reshape(self._between_columns.shape)
        half = _fill(known, self._between_columns, cast)
        return _fill(np.ascontiguousarray(half.T), self._between_rows, cast).T


def _fill(known: Image, between: Pixels, cast: Cast) -> Image:
    """Put a column after each column of `known` (n, m), whose pixels are `between` (n, m): (n, 2 m)."""
    filled = np.empty((known.shape[0], 2 * known.shape[1]), dtype=np.float32)
    filled[:, ::2] = known
    step = known[:, 1:] - known[:, :-1]
    middle = known[:, :-1] + np.float32(0.5) * step
    bend = np.abs(step[:, 1:] - step[:, :-1])
    allowed = _STRAIGHT * middle
    bent = np.zeros(known.shape, dtype=bool)
    bent[:, :-2] = bend > allowed[:, :-1]
    bent[:, 1:-1] |= bend > allowed[:, 1:]
    bent[:, -1] = True
    filled[:, 1:-1:2] = middle
    unknown = np.flatnonzero(bent)
    places = filled[:, 1::2]
    places[bent] = cast(between.ravel()[unknown])
    return filled
