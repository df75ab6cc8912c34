"""Appearance of a world's surfaces: colours, patterns, sun, sky and haze.

Arrays have one column for each pixel, colours (3, N) as well as places (3, N): NumPy processes long rows several times
as fast as short ones.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from skillwing.sim_mujoco.camera import texture
from skillwing.sim_mujoco.camera.ground import GroundPaint
from skillwing.sim_mujoco.camera.shading import LEVELS, Lights, Surfaces, Texels, developed, texels_in_pixels
from skillwing.sim_mujoco.world.world import BUILDING, TERRAIN, World

Array = NDArray[np.float32]
Faces = NDArray[np.int32]
Rgb = NDArray[np.uint8]

SUN = np.array([-0.45, -0.6, 0.85], dtype=np.float32) / np.float32(math.sqrt(0.45**2 + 0.6**2 + 0.85**2))
"""Direction to the sun, as in the pictures of the worlds."""
_SUNLIGHT = np.array([[0.95], [0.91], [0.84]], dtype=np.float32)
_SKYLIGHT = np.array([[0.50], [0.54], [0.58]], dtype=np.float32)
_HORIZON = np.array([[0.87], [0.91], [0.95]], dtype=np.float32)
_ZENITH = np.array([[0.50], [0.66], [0.88]], dtype=np.float32)
_VISIBILITY = 900.0
"""Distance over which two thirds of the contrast are lost to haze [m]."""
_GREY = np.rint(255.0 * np.linspace(0.0, 1.0, LEVELS) ** (1 / 1.15)).astype(np.uint8)
"""Values of pixels for the levels of light."""
_LIGHTS = Lights(_SUNLIGHT.ravel(), _SKYLIGHT.ravel(), _HORIZON.ravel())
_GROUND, _MASONRY, _LEAVES, _PLAIN = range(4)


class Appearance:
    """Colours of places on the faces of one world. The patterns come from the world's seed.

    Faces are seen from their front only, because objects are solid. The sky is a face as well, the last one. It has the
    colour of the zenith and fades into that of the horizon by its height, as others do by their distance. So no pixel
    needs a case of its own.
    """

    def __init__(self, world: World) -> None:
        triangles = world.triangles()
        corners = np.stack(triangles.corners())
        normals = np.cross(corners[1] - corners[0], corners[2] - corners[0]).astype(np.float32)
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), np.float32(1e-12))
        terrain, building = triangles.labels == TERRAIN, triangles.labels == BUILDING
        self.surfaces = _surfaces(normals, corners[0], terrain)
        self.normals = np.concatenate([normals, np.zeros((1, 3), dtype=np.float32)])
        """Unit vectors (F + 1, 3); the sky has none."""
        self.facing_sun = np.maximum(self.normals @ SUN, np.float32(0.0))
        """Share of the sun's light (F + 1,) that falls on each face, 0 for the sky."""
        open_sky = np.append(np.float32(0.65) + np.float32(0.35) * normals[:, 2], np.float32(1.0))
        colours = world.colours()
        self._ground = GroundPaint(corners, terrain, colours, world.paving)
        # In the full light of the sky a surface has its own brightness.
        own_colours = np.concatenate([self._ground.colours.T, _ZENITH / _SKYLIGHT], axis=1)
        green = (colours[:, 1] > colours[:, 0]) & (colours[:, 1] > colours[:, 2])
        kinds = np.select([terrain, building, green], [_GROUND, _MASONRY, _LEAVES], _PLAIN)
        kind = np.append(kinds, _PLAIN).astype(np.int32)
        rng = np.random.default_rng((world.seed, 3000))
        patterns = texture.ground(rng), texture.masonry(rng), texture.leaves(rng), texture.plain()
        self._texels = Texels(*texture.texels_of(*patterns))
        # Patterns have coordinates x and y on the ground, along and up on walls.
        x, y, z = self.normals.T
        along = np.hypot(x, y) + np.float32(1e-6)
        flat = (np.abs(z) > np.float32(0.7)).astype(np.float32)
        u_of_x, u_of_y = np.where(flat, np.float32(1.0), -y / along), np.where(flat, np.float32(0.0), x / along)
        self._tables = Surfaces(
            np.ascontiguousarray(own_colours, dtype=np.float32), self.facing_sun, open_sky, u_of_x, u_of_y, flat, kind
        )

    def picture(self, faces: Faces, places: Array, directions: Array, away: Array, sunny: Array, pixel: float) -> Rgb:
        """Picture (height, width, 3) of places (3, N) on these faces (height, width), -1 for the sky, in unit
        directions (3, N).

        away: distance (N,) [m]. sunny: 1 where the sun shines, 0 in the shade, (height / 2, width / 2). pixel: its
        width at a distance of 1 m [m].
        """
        row = faces.reshape(-1)
        table = self._tables
        texels = texels_in_pixels(row, away, table.kind, self._texels.per_metre, np.float32(pixel))
        patches = self._ground.patches(row, places[0], places[1])
        halvings, haze = np.log2(texels), np.exp(away * np.float32(-1.0 / _VISIBILITY))
        paint, up = self._ground.paint, directions[2]
        return developed(table, paint, self._texels, _LIGHTS, faces, places, patches, halvings, haze, up, sunny, _GREY)


def _surfaces(normals: Array, corners: Array, is_terrain: NDArray[np.bool_]) -> NDArray[np.int32]:
    """Numbers of the surfaces of the faces, with that of the sky at the end. Faces in one plane are one surface, and so
    is the ground, which is smooth enough for interpolation."""
    plane = np.column_stack([normals, np.einsum("ij,ij->i", normals, corners)])
    _, number = np.unique(np.rint(plane * 100.0).astype(np.int32), axis=0, return_inverse=True)
    surfaces = number.ravel().astype(np.int32) + 1
    surfaces[is_terrain] = 0
    return np.append(surfaces, np.int32(-1))
