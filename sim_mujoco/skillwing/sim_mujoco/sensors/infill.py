"""Depth pictures from an eighth of their rays: pixels on a plane are interpolated, all others are cast.

On a plane the inverse depth is a linear function of the pixel's position. If two known neighbours lie on one line with
the next pixel on either side, the pixel between them lies on it too. Pixels at edges and on curved surfaces break the
line and get a ray of their own. Objects narrower than two pixels, or lower than four, may be missed: thin upright
objects are common, thin horizontal ones are rare.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Pixels = NDArray[np.intp]
Image = NDArray[np.float32]
Cast = Callable[[Pixels], Image]
"""Ray caster: from numbers of pixels, counted row by row, to their inverse depths (n,)."""

_STRAIGHT = np.float32(2e-3)
"""Largest deviation of neighbours from one line, relative to the value."""


class Infill:
    """Interpolation of pictures of one size. The width is even, the height a multiple of four."""

    def __init__(self, height: int, width: int) -> None:
        self._numbers = np.arange(height * width, dtype=np.intp).reshape(height, width)
        self.first: Pixels = self._numbers[::4, ::2].ravel()
        """Pixels that are always cast, in this order."""

    def inverse_depths(self, first: Image, cast: Cast) -> Image:
        """Inverse depths (height, width), 0 where there is no return, from those of the `first` pixels (n,)."""
        image, numbers = np.empty(self._numbers.shape, dtype=np.float32), self._numbers
        pixels = image.reshape(-1)
        pixels[self.first] = first
        for known, between, chosen_from in (
            (image[::4, ::2], image[2::4, ::2], numbers[2::4, ::2]),
            (image[::2, ::2].T, image[::2, 1::2].T, numbers[::2, 1::2].T),
            (image[::2], image[1::2], numbers[1::2]),
        ):
            between[:-1], bent = _between(known)
            chosen = chosen_from[bent]
            pixels[chosen] = cast(chosen)
        return image


def _between(known: Image) -> tuple[Image, NDArray[np.bool_]]:
    """Rows (n - 1, m) midway between the rows `known` (n, m), and a mask (n, m) of pixels after which the line breaks.

    The last row is masked as well.
    """
    step = known[1:] - known[:-1]
    middle = np.float32(0.5) * step
    middle += known[:-1]
    bend = np.abs(step[1:] - step[:-1])
    allowed = _STRAIGHT * middle
    bent = np.ones_like(known, dtype=np.bool_)
    bent[1:-1] = bend > allowed[1:]
    bent[:-2] &= bend > allowed[:-1]
    return middle, bent
