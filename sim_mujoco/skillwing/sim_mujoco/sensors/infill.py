"""A picture from a quarter of its rays: what lies on a plane between known pixels is computed, the rest is cast.

On a plane the inverse of the depth is a linear function of the pixel's place. Where four known neighbours in a row lie
on one line, the pixel in their middle lies on it too; edges, silhouettes and curved surfaces break the line and get a
ray of their own. What is thinner than two pixels may be missed.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Pixels = NDArray[np.int64]
Image = NDArray[np.float32]
Cast = Callable[[Pixels, Pixels], Image]
"""Inverse depths (n,) of the pixels in these rows and columns."""

_STRAIGHT = np.float32(2e-3)
"""How far, relative to the value, neighbours may lie off one line."""


def inverse_depths(height: int, width: int, cast: Cast) -> Image:
    """Inverse depths (height, width), both even; 0 where there is no return."""
    rows, columns = np.meshgrid(np.arange(0, height, 2), np.arange(0, width, 2), indexing="ij")
    known = cast(rows.ravel(), columns.ravel()).reshape(rows.shape)
    half = _fill(known, lambda i, j: cast(2 * i, j))
    return _fill(half.T, lambda i, j: cast(j, i)).T


def _fill(known: Image, cast: Cast) -> Image:
    """Put a column after each column of `known` (n, m): (n, 2 m)."""
    filled = np.empty((known.shape[0], 2 * known.shape[1]), dtype=np.float32)
    filled[:, ::2] = known
    step = np.diff(known, axis=1)
    middle = known[:, :-1] + np.float32(0.5) * step
    bend = np.pad(np.abs(np.diff(step, axis=1)), ((0, 0), (1, 1)))
    straight = np.maximum(bend[:, :-1], bend[:, 1:]) <= _STRAIGHT * middle
    filled[:, 1:-1:2] = middle
    unknown = np.ones_like(known, dtype=bool)
    unknown[:, :-1] = ~straight
    i, j = np.nonzero(unknown)
    filled[i, 2 * j + 1] = cast(i, 2 * j + 1)
    return filled
