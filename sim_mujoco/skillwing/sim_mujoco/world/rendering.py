"""Shaded pictures of a world from its triangles, with sun, sky and shade, cast on the processor.

They need neither a screen nor GL. Colours are those of the solids and of the paving; sensors do not use them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from numpy.typing import NDArray

from skillwing.onboard.frames.vectors import Vector
from skillwing.sim_mujoco.world.layouts.ground import Strip
from skillwing.sim_mujoco.world.world import TERRAIN, World

Array = NDArray[np.float32]

_SUN = np.array([-0.45, -0.6, 0.85], dtype=np.float32) / np.float32(math.sqrt(0.45**2 + 0.6**2 + 0.85**2))
_SUNLIGHT, _SKYLIGHT = np.float32(0.95), np.float32(0.62)
_WARM = np.array([1.0, 0.96, 0.88], dtype=np.float32)
_COOL = np.array([0.86, 0.93, 1.0], dtype=np.float32)
_SKY = np.array([[0.87, 0.91, 0.95], [0.55, 0.70, 0.88]], dtype=np.float32)
_SKY_RAYS = 14
_SKY_REACH = 8.0
"""Distance within which objects shade a place from the sky [m]."""
WIDEST_ROAD = 8.0
"""Width of strips up to which their ends are round [m]: roads join at corners, yards do not."""
_FAR = 2000.0
_LIFT = np.float32(2e-3)


@dataclass(frozen=True, slots=True)
class CameraRays:
    """One ray for each pixel: origins and unit directions (height * width, 3), and the picture's size."""

    origins: Array
    directions: Array
    size: tuple[int, int]


def from_above(low: tuple[float, float], high: tuple[float, float], height: float, rows: int) -> CameraRays:
    """A map: parallel rays straight down onto the rectangle from `low` to `high`, north up."""
    columns = round(rows * (high[0] - low[0]) / (high[1] - low[1]))
    x = low[0] + (np.arange(columns) + 0.5) / columns * (high[0] - low[0])
    y = high[1] - (np.arange(rows) + 0.5) / rows * (high[1] - low[1])
    east, north = np.meshgrid(x, y)
    origins = np.stack([east.ravel(), north.ravel(), np.full(east.size, height)], axis=1).astype(np.float32)
    down = np.broadcast_to(np.array([0.0, 0.0, -1.0], dtype=np.float32), origins.shape)
    return CameraRays(origins, np.ascontiguousarray(down), (rows, columns))


def from_place(eye: Vector, at: Vector, size: tuple[int, int], width: float) -> CameraRays:
    """A perspective picture, rows by columns, from `eye` towards `at`, so many degrees wide."""
    rows, columns = size
    forward = np.subtract(at, eye)
    forward = forward / np.linalg.norm(forward)
    right = np.cross(forward, (0.0, 0.0, 1.0))
    right = right / np.linalg.norm(right)
    up = np.cross(right, forward)
    half = math.tan(math.radians(width) / 2)
    u = ((np.arange(columns) + 0.5) / columns * 2 - 1) * half
    v = (1 - (np.arange(rows) + 0.5) / rows * 2) * half * rows / columns
    across, upright = np.meshgrid(u, v)
    rays = forward + across[..., None] * right + upright[..., None] * up
    rays = _unit(rays.reshape(-1, 3).astype(np.float32))
    return CameraRays(np.broadcast_to(np.array(eye, dtype=np.float32), rays.shape).copy(), rays, size)


class Renderer:
    """Renderer of one world; the same world gives the same pictures."""

    def __init__(self, world: World) -> None:
        triangles = world.triangles()
        self._scene = EmbreeScene()
        self._mesh = TriangleMesh(self._scene, triangles.vertices, triangles.faces)
        self._colours = world.colours()
        self._is_terrain = triangles.labels == TERRAIN
        self._paving = world.paving

    def picture(self, view: CameraRays, *, samples: int = 2) -> NDArray[np.uint8]:
        """The picture (rows / samples, columns / samples, 3): each pixel is the mean of samples x samples rays."""
        light = self._light(view.origins, view.directions).reshape(*view.size, 3)
        rows, columns = view.size[0] // samples, view.size[1] // samples
        light = (
            light[: rows * samples, : columns * samples].reshape(rows, samples, columns, samples, 3).mean(axis=(1, 3))
        )
        return (255.0 * np.clip(light, 0.0, 1.0) ** (1 / 1.15) + 0.5).astype(np.uint8)

    def _light(self, origins: Array, directions: Array) -> Array:
        hit = self._scene.run(origins, directions, output=True)
        face = hit["primID"].astype(np.int64)
        upward = np.clip(directions[:, 2:], 0.0, 1.0)
        light = _SKY[0] + (_SKY[1] - _SKY[0]) * np.sqrt(upward)
        seen = np.flatnonzero(face >= 0)
        if not len(seen):
            return light
        normals = _unit(hit["Ng"][seen])
        normals *= -np.sign(np.einsum("ij,ij->i", normals, directions[seen]))[:, None]
        places = origins[seen] + directions[seen] * hit["tfar"][seen, None] + normals * _LIFT
        colours = self._surface(face[seen], places)
        sunny = np.clip(normals @ _SUN, 0.0, 1.0) * self._is_free(places, np.broadcast_to(_SUN, places.shape), _FAR)
        sky = self._openness(places, normals) * (0.65 + 0.35 * normals[:, 2])
        light[seen] = colours * (_SUNLIGHT * sunny[:, None] * _WARM + _SKYLIGHT * sky[:, None] * _COOL)
        return light

    def _surface(self, faces: NDArray[np.int64], places: Array) -> Array:
        colours = self._colours[faces].copy()
        ground = np.flatnonzero(self._is_terrain[faces])
        colours[ground] = painted(places[ground, :2], colours[ground], self._paving)
        return colours

    def _openness(self, places: Array, normals: Array) -> Array:
        """Share of the sky above each place that nothing near hides, 0 to 1."""
        free = np.zeros(len(places), dtype=np.float32)
        for around in _sphere(_SKY_RAYS):
            # Points on the unit sphere around the tip of the normal: rays by the cosine of their angle to it.
            rays = np.asarray(normals + 0.999 * around, dtype=np.float32)
            free += self._is_free(places, _unit(rays), _SKY_REACH)
        return free / np.float32(_SKY_RAYS)

    def _is_free(self, places: Array, rays: Array, reach: float) -> Array:
        distances = self._scene.run(places, np.ascontiguousarray(rays), dists=reach, query="DISTANCE")
        return (distances >= reach).astype(np.float32)


def _sphere(count: int) -> Array:
    """Points (count, 3) spread evenly over the unit sphere, on a spiral; always the same, so pictures have no grain."""
    z = 1.0 - (2.0 * np.arange(count) + 1.0) / count
    angle = np.arange(count) * (math.pi * (3.0 - math.sqrt(5.0)))
    radius = np.sqrt(1.0 - z * z)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=1).astype(np.float32)


def patches(x: Array, y: Array) -> Array:
    """Factors (N,) of lighter and darker patches of grass at places x, y (N,) [m]."""
    waves = np.sin(0.31 * x + 1.7 * np.sin(0.23 * y)) * np.sin(0.27 * y + 1.3 * np.sin(0.19 * x))
    return (1.0 + 0.06 * waves).astype(np.float32)


def painted(places: Array, grass: Array, paving: Sequence[Strip]) -> Array:
    """Grass with lighter and darker patches, and the strips that lie on it."""
    x, y = places.T
    colours = grass * patches(x, y)[:, None]
    for strip in paving:
        (ax, ay), (bx, by) = strip.start, strip.end
        length = math.hypot(bx - ax, by - ay)
        ux, uy = (bx - ax) / length, (by - ay) / length
        along, aside = (x - ax) * ux + (y - ay) * uy, (y - ay) * ux - (x - ax) * uy
        beyond = np.clip(along - length, 0.0, None) + np.clip(-along, 0.0, None)
        covered = np.hypot(aside, beyond) <= strip.width / 2
        if strip.width > WIDEST_ROAD:
            covered &= beyond == 0.0
        colours[covered] = strip.colour
    return colours


def _unit(vectors: Array) -> Array:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), np.float32(1e-12))
