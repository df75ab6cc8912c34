"""A picture from an eighth of its rays: what lies on a plane between known pixels is computed, the rest is cast.

On a plane the inverse of the depth is a linear function of the pixel's place. Where two known neighbours lie on one
line with the next one on either side, the pixel between them lies on it too. An edge breaks the line on both sides of
the pixels that it passes between; these get a ray of their own, and so does what is curved. What is narrower than two
pixels, or lower than four, may be missed: thin things that stand upright are many, thin ones that lie in the air few.
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
    """Computes pictures of one size: an even width, a height that is a multiple of four."""

    def __init__(self, height: int, width: int) -> None:
        self._numbers = np.arange(height * width, dtype=np.intp).reshape(height, width)
        self.first: Pixels = self._numbers[::4, ::2].ravel()
        """The pixels that are cast in any case, always in this order."""

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
    """The rows (n - 1, m) in the middles between the rows `known` (n, m), and after which (n, m) of these that does not
    hold, with all of the last."""
    step = known[1:] - known[:-1]
    middle = np.float32(0.5) * step
    middle += known[:-1]
    bend = np.abs(step[1:] - step[:-1])
    allowed = _STRAIGHT * middle
    bent = np.ones_like(known, dtype=np.bool_)
    bent[1:-1] = bend > allowed[1:]
    bent[:-2] &= bend > allowed[:-1]
    return middle, bent
