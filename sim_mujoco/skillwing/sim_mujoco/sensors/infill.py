"""A picture from a quarter of its rays: what lies on a plane between known pixels is computed, the rest is cast.

On a plane the inverse of the depth is a linear function of the pixel's place. Where two known neighbours lie on one
line with the next one on either side, the pixel between them lies on it too. An edge breaks the line on both sides of
the pixels that it passes between; these get a ray of their own, and so does what is curved. What is thinner than two
pixels may be missed.
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
        self.first: Pixels = self._numbers[::2, ::2].ravel()
        """The pixels that are cast in any case, always in this order."""

    def inverse_depths(self, first: Image, cast: Cast) -> Image:
        """Inverse depths (height, width), 0 where there is no return, from those of the `first` pixels (n,)."""
        image = np.empty(self._numbers.shape, dtype=np.float32)
        image[::2, ::2] = first.reshape(image[::2, ::2].shape)
        pixels = image.reshape(-1)
        for rows, numbers in ((image[::2].T, self._numbers[::2].T), (image, self._numbers)):
            bent = numbers[1::2][_fill(rows)]
            pixels[bent] = cast(bent)
        return image


def _fill(image: Image) -> NDArray[np.bool_]:
    """Compute every second row (n, m) of `image` (2 n, m) from the rows between, and tell where that cannot be done."""
    known = image[::2]
    step = known[1:] - known[:-1]
    middle = known[:-1] + np.float32(0.5) * step
    bend = np.abs(step[1:] - step[:-1])
    allowed = _STRAIGHT * middle
    bent = np.ones_like(known, dtype=np.bool_)
    bent[1:-1] = bend > allowed[1:]
    bent[:-2] &= bend > allowed[:-1]
    image[1:-1:2] = middle
    return bent
