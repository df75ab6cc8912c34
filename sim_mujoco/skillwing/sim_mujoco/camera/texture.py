"""Textures of surfaces: masonry and ground, as mip-mapped patterns that repeat.

A pattern is stored at several resolutions, each half of the one before (Williams, 1983). The lookup uses the resolution
that fits the size of a pixel on the surface. So far patterns fade into their mean and do not flicker.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, zoom

Array = NDArray[np.float32]
Kinds = NDArray[np.int32]
SIDE = 512
"""Texels of a pattern in each direction."""
COARSEST = SIDE.bit_length() - 1
"""Number of halvings of a pattern down to one texel."""


class Pattern(NamedTuple):
    """Brightness factors around 1 (SIDE, SIDE), repeated in both directions, and the width of the pattern [m]."""

    texels: Array
    width: float


def texels_of(*patterns: Pattern) -> tuple[Array, Kinds, Array]:
    """All resolutions of the patterns in one table, the start of each resolution of each pattern, and the patterns'
    texels per metre."""
    values = np.concatenate([level.ravel() for each in patterns for level in _levels(each.texels)])
    sizes = np.tile(4 ** np.arange(COARSEST, -1, -1), len(patterns))
    per_metre = np.array([SIDE / each.width for each in patterns], dtype=np.float32)
    return values, (np.cumsum(sizes) - sizes).astype(np.int32), per_metre


def _levels(pattern: Array) -> list[Array]:
    """The pattern (SIDE, SIDE) in full resolution, half, a quarter, and so on down to (1, 1)."""
    levels = [pattern]
    while len(levels[-1]) > 1:
        n = len(levels[-1]) // 2
        levels.append(levels[-1].reshape(n, 2, n, 2).mean(axis=(1, 3), dtype=np.float32))
    return levels


def masonry(rng: np.random.Generator) -> Pattern:
    """Wall of 8 m: different blocks of 0.5 x 0.25 m with joints, stains and a few cracks."""
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
    return Pattern(pattern.astype(np.float32), width)


def ground(rng: np.random.Generator) -> Pattern:
    """Grass or gravel: 16 m of it."""
    pattern = 1.0 + 0.10 * _cloudy(rng, 30.0) + 0.09 * _cloudy(rng, 6.0) + 0.10 * _cloudy(rng, 1.2)
    return Pattern(pattern.astype(np.float32), 16.0)


def plain() -> Pattern:
    """The same everywhere."""
    return Pattern(np.ones((SIDE, SIDE), dtype=np.float32), float(SIDE))


def leaves(rng: np.random.Generator) -> Pattern:
    """Crowns of trees: 6 m of them."""
    pattern = 1.0 + 0.22 * _cloudy(rng, 12.0) + 0.16 * _cloudy(rng, 3.0)
    return Pattern(pattern.astype(np.float32), 6.0)


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
