"""Gently rolling ground: heights from a seed, flat around the home pad."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

AMPLITUDE = 0.45
"""Largest height above or depth below the home pad, unless another is given [m]."""
_PAD_RADIUS, _BLEND = 3.0, 6.0


@dataclass(frozen=True, slots=True)
class Terrain:
    """Heights above the home pad [m], float64 (rows along y, columns along x), over a centred rectangle."""

    heights: NDArray[np.float64]
    centre: tuple[float, float]
    half: tuple[float, float]

    @property
    def lowest(self) -> float:
        return float(self.heights.min())

    @property
    def highest(self) -> float:
        return float(self.heights.max())

    def height(self, x: float, y: float) -> float:
        """Height of the ground at a place, above the home pad [m]; beyond the border that of the border."""
        places = zip(self.centre, self.half, self.heights.T.shape, strict=True)
        east, north = (np.linspace(centre - half, centre + half, count) for centre, half, count in places)
        return float(np.interp(y, north, [np.interp(x, east, row) for row in self.heights]))


def make_terrain(
    rng: np.random.Generator,
    centre: tuple[float, float],
    half: tuple[float, float],
    step: float = 1.0,
    amplitude: float = AMPLITUDE,
) -> Terrain:
    """A sum of a few long waves (8 to 40 m), faded out towards the home pad at the origin."""
    columns, rows = (round(2 * extent / step) + 1 for extent in half)
    x = np.linspace(centre[0] - half[0], centre[0] + half[0], columns)
    y = np.linspace(centre[1] - half[1], centre[1] + half[1], rows)
    east, north = np.meshgrid(x, y)
    heights = np.zeros_like(east)
    for _ in range(10):
        wavelength, bearing, phase = rng.uniform(8.0, 40.0), rng.uniform(0, np.pi), rng.uniform(0, 2 * np.pi)
        across = east * np.cos(bearing) + north * np.sin(bearing)
        heights += wavelength * np.sin(2 * np.pi * across / wavelength + phase)
    heights *= amplitude / np.abs(heights).max()
    fade = np.clip((np.hypot(east, north) - _PAD_RADIUS) / _BLEND, 0.0, 1.0)
    return Terrain(heights * fade * fade * (3.0 - 2.0 * fade), centre, half)
