"""What surfaces look like from near: masonry and ground, as mip-mapped patterns that repeat.

A pattern is stored at several resolutions, each half of the one before (Williams, 1983), and looked up at the one that
fits the size of a pixel on the surface: far away it fades into its mean instead of flickering.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, zoom

Array = NDArray[np.float32]
SIDE = 512
"""Texels of a pattern in each direction."""


class Texture:
    """A pattern of brightness factors around 1 that repeats every `width` metres in both directions."""

    def __init__(self, pattern: Array, width: float) -> None:
        self._per_metre = np.float32(len(pattern) / width)
        levels = [pattern]
        while len(levels[-1]) > 1:
            n = len(levels[-1]) // 2
            levels.append(levels[-1].reshape(n, 2, n, 2).mean(axis=(1, 3), dtype=np.float32))
        self._texels = np.concatenate([level.ravel() for level in levels])
        self._side = np.array([len(level) for level in levels], dtype=np.int32)
        self._start = np.concatenate([[0], np.cumsum(self._side.astype(np.int64) ** 2)[:-1]]).astype(np.int32)

    def at(self, u: Array, v: Array, footprint: Array) -> Array:
        """Factors (N,) at places u, v (N,) on the surface [m], for pixels that are `footprint` (N,) wide there [m]."""
        level = np.log2(np.maximum(footprint * self._per_metre, np.float32(1.0)))
        level = np.minimum(np.rint(level).astype(np.int32), len(self._side) - 1)
        side = self._side[level]
        scale = self._per_metre * side.astype(np.float32) / np.float32(self._side[0])
        column = np.floor(u * scale).astype(np.int32) & (side - 1)
        row = np.floor(v * scale).astype(np.int32) & (side - 1)
        return self._texels[self._start[level] + row * side + column]


def masonry(rng: np.random.Generator) -> Texture:
    """Blocks of 0.5 x 0.25 m with joints, unlike one another, with stains and a few cracks: 8 m of a wall."""
    width, block_high, block_wide = 8.0, 0.25, 0.5
    metres = (np.arange(SIDE) + 0.5) * width / SIDE
    course = (metres // block_high).astype(int)
    shifted = metres[None, :] + 0.5 * block_wide * (course[:, None] % 2)
    number = (shifted // block_wide).astype(int) % round(width / block_wide)
    tone = rng.normal(0.0, 0.06, (round(width / block_high), round(width / block_wide)))
    pattern = 1.0 + tone[course[:, None], number]
    joint = (metres[:, None] % block_high < 0.025) | (shifted % block_wide < 0.025)
    pattern[joint] *= 0.72
    pattern *= 1.0 + 0.10 * _cloudy(rng, 40.0) + 0.04 * _cloudy(rng, 4.0)
    for _ in range(3):
        _crack(rng, pattern)
    return Texture(pattern.astype(np.float32), width)


def ground(rng: np.random.Generator) -> Texture:
    """Grass or gravel: 16 m of it."""
    pattern = 1.0 + 0.10 * _cloudy(rng, 30.0) + 0.09 * _cloudy(rng, 6.0) + 0.10 * _cloudy(rng, 1.2)
    return Texture(pattern.astype(np.float32), 16.0)


def leaves(rng: np.random.Generator) -> Texture:
    """Crowns of trees: 6 m of them."""
    pattern = 1.0 + 0.22 * _cloudy(rng, 12.0) + 0.16 * _cloudy(rng, 3.0)
    return Texture(pattern.astype(np.float32), 6.0)


def _cloudy(rng: np.random.Generator, size: float) -> NDArray[np.float64]:
    """Noise that repeats, of standard deviation 1, in lumps of about so many texels."""
    coarse = 1 << max(0, int(math.log2(size / 8)))  # large lumps need few samples
    side = SIDE // coarse
    noise = np.asarray(gaussian_filter(rng.standard_normal((side, side)), size / 2 / coarse, mode="wrap"))
    if coarse > 1:
        noise = np.asarray(zoom(noise, coarse, order=1, mode="grid-wrap", grid_mode=True))
    return (noise - noise.mean()) / noise.std()


def _crack(rng: np.random.Generator, pattern: NDArray[np.float64]) -> None:
    """A dark line of 2 to 3 cm that wanders across the wall."""
    row, column, heading = rng.uniform(0, SIDE), rng.uniform(0, SIDE), rng.uniform(0, np.pi)
    for _ in range(int(rng.uniform(60, 140))):
        heading += rng.normal(0.0, 0.25)
        row, column = row + np.sin(heading), column + np.cos(heading)
        for side in (0, 1):
            pattern[int(row) % SIDE, int(column + side) % SIDE] *= 0.55
