"""How the surfaces of a world look: colours, patterns, sun, sky and haze."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from skillwing.sim_mujoco.camera import texture
from skillwing.sim_mujoco.world.rendering import painted
from skillwing.sim_mujoco.world.world import BUILDING, TERRAIN, World

Array = NDArray[np.float32]
Faces = NDArray[np.int32]

SUN = np.array([-0.45, -0.6, 0.85], dtype=np.float32) / np.float32(math.sqrt(0.45**2 + 0.6**2 + 0.85**2))
"""Towards the sun, as in the pictures of the worlds."""
_LIGHTS = np.array([[0.95, 0.91, 0.84], [0.50, 0.54, 0.58]], dtype=np.float32)
"""Of the sun and of the sky."""
_HORIZON = np.array([0.87, 0.91, 0.95], dtype=np.float32)
_ZENITH = np.array([0.50, 0.66, 0.88], dtype=np.float32)
_VISIBILITY = 900.0
"""Distance over which two thirds of the contrast are lost to haze [m]."""


class Appearance:
    """Colours of places on the faces of one world. The patterns come from the world's seed."""

    def __init__(self, world: World) -> None:
        triangles = world.triangles()
        a, b, c = triangles.corners()
        normals = np.cross(b - a, c - a).astype(np.float32)
        self.normals = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), np.float32(1e-12))
        self._colours = world.colours()
        self._paving = world.paving
        rng = np.random.default_rng((world.seed, 3000))
        self._textures = (texture.ground(rng), texture.masonry(rng), texture.leaves(rng))
        green = (self._colours[:, 1] > self._colours[:, 0]) & (self._colours[:, 1] > self._colours[:, 2])
        self._is_terrain = triangles.labels == TERRAIN
        self._kind = np.full(len(triangles.faces), -1, dtype=np.int8)
        self._kind[self._is_terrain] = 0
        self._kind[triangles.labels == BUILDING] = 1
        self._kind[green & (triangles.labels != TERRAIN) & (triangles.labels != BUILDING)] = 2
        self.surfaces = _surfaces(self.normals, a, self._is_terrain)

    def colours(self, faces: Faces, places: Array, normals: Array, sun: Array, away: Array, pixel: float) -> Array:
        """Colours (N, 3), 0 to 1, of places (N, 3) on these faces (N,), whose `normals` (N, 3) point at the viewer.

        sun: 1 (N,) where it shines, 0 in the shade. away: distance (N,) [m]. pixel: its width at a distance of 1 m [m].
        """
        base = np.take(self._colours, faces, axis=0)
        ground = np.flatnonzero(self._is_terrain[faces])
        base[ground] = painted(places[ground, :2], base[ground], self._paving)
        # A pattern lies on the ground in x and y, on walls along the wall and up.
        flat = np.abs(normals[:, 2]) > np.float32(0.7)
        along = np.hypot(normals[:, 0], normals[:, 1]) + np.float32(1e-6)
        u = np.where(flat, places[:, 0], (places[:, 1] * normals[:, 0] - places[:, 0] * normals[:, 1]) / along)
        v = np.where(flat, places[:, 1], places[:, 2])
        footprint = away * np.float32(pixel)
        kinds = self._kind[faces]
        for kind, pattern in enumerate(self._textures):
            covered = np.flatnonzero(kinds == kind)
            base[covered] *= pattern.at(u[covered], v[covered], footprint[covered])[:, None]
        lit = np.clip(normals @ SUN, 0.0, 1.0) * sun
        open_sky = np.float32(0.65) + np.float32(0.35) * normals[:, 2]
        base *= np.stack([lit, open_sky], axis=1) @ _LIGHTS
        base -= _HORIZON
        base *= np.exp(away * np.float32(-1.0 / _VISIBILITY))[:, None]
        base += _HORIZON
        return base


def sky(directions: Array) -> Array:
    """Colours (N, 3) of the sky in these directions (N, 3), of any length."""
    upward = np.clip(directions[:, 2:] / np.linalg.norm(directions, axis=1, keepdims=True), 0.0, 1.0)
    return _HORIZON + (_ZENITH - _HORIZON) * np.sqrt(upward)


def _surfaces(normals: Array, corners: Array, is_terrain: NDArray[np.bool_]) -> NDArray[np.int32]:
    """The number of the surface that each face belongs to, and that of the sky behind the last one: faces in one plane
    are one surface, and so is the ground, which is smooth enough to be interpolated."""
    plane = np.column_stack([normals, np.einsum("ij,ij->i", normals, corners)])
    _, number = np.unique(np.rint(plane * 100.0).astype(np.int32), axis=0, return_inverse=True)
    surfaces = number.ravel().astype(np.int32) + 1
    surfaces[is_terrain] = 0
    return np.append(surfaces, np.int32(-1))
