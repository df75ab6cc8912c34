"""Reference for the compiled loops of the RGB camera: the same rules in NumPy."""

from __future__ import annotations

import numpy as np

from skillwing.sim_mujoco.camera.shading import LEVELS, Lights, Surfaces, Texels
from skillwing.sim_mujoco.camera.texture import COARSEST, SIDE


def trace(inverse: np.ndarray, face: np.ndarray, surface_of: np.ndarray) -> np.ndarray:
    """Fill every other row, and return the mask of the pixels in these rows that have to be cast."""
    known = face[::2]
    inverse[1:-1:2] = np.float32(0.5) * (inverse[:-2:2] + inverse[2::2])
    face[1::2] = known
    surface = surface_of.take(known)
    unknown = np.ones(surface.shape, dtype=np.bool_)
    np.not_equal(surface[:-1], surface[1:], out=unknown[:-1])
    return unknown


def texels(table: Texels, kind: np.ndarray, u: np.ndarray, v: np.ndarray, footprint: np.ndarray) -> np.ndarray:
    """Factors (N,) of the patterns with these numbers (N,) at u, v (N,), for pixels of this width (N,) [m]."""
    per_metre = table.per_metre.take(kind)
    level = np.log2(np.maximum(footprint * per_metre, np.float32(1.0)))
    level = np.minimum(np.rint(level).astype(np.int32), COARSEST)
    column = (np.floor(u * per_metre).astype(np.int32) & (SIDE - 1)) >> level
    row = (np.floor(v * per_metre).astype(np.int32) & (SIDE - 1)) >> level
    start = table.start.take(kind * np.int32(COARSEST + 1) + level)
    return table.values.take(start + ((row << (COARSEST - level)) + column))


def levels(
    tables: Surfaces,
    table: Texels,
    lights: Lights,
    painted: np.ndarray,
    faces: np.ndarray,
    places: np.ndarray,
    directions: np.ndarray,
    away: np.ndarray,
    sunny: np.ndarray,
    pixel: float,
) -> np.ndarray:
    """Levels of light (3, N) of places (3, N) on faces (N,) with these colours (3, N)."""
    x, y, z = places
    u = tables.u_of_x.take(faces) * x + tables.u_of_y.take(faces) * y
    v = z + tables.flat.take(faces) * (y - z)
    light = painted * texels(table, tables.kind.take(faces), u, v, away * np.float32(pixel))
    sun, sky = tables.facing_sun.take(faces) * sunny, tables.open_sky.take(faces)
    light *= lights.sun[:, None] * sun + lights.sky[:, None] * sky
    contrast = np.exp(away * np.float32(-1.0 / 900.0))
    above = np.flatnonzero(faces < 0)
    contrast[above] = np.sqrt(np.maximum(directions[2].take(above), np.float32(0.0)))
    light -= lights.horizon[:, None]
    light *= contrast
    light += lights.horizon[:, None]
    light *= np.float32(LEVELS - 1)
    return np.clip(light, 0, LEVELS - 1).astype(np.uint16)
