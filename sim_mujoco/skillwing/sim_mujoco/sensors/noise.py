"""White noise for large arrays, cheaply."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


class NoiseTable:
    """A table of standard normal numbers, read from a random place each time.

    Drawing 57,600 fresh numbers for every depth picture costs time beside casting its rays. A random place in a table
    of a million is as good for a sensor and nearly free.
    """

    def __init__(self, rng: np.random.Generator, size: int = 1 << 20) -> None:
        self._rng = rng
        self._table = rng.standard_normal(size, dtype=np.float32)

    def draw(self, count: int) -> NDArray[np.float32]:
        """Numbers (count,), not to be changed."""
        start = int(self._rng.integers(0, len(self._table) - count))
        return self._table[start : start + count]
