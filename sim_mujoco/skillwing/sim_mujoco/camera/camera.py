"""The RGB camera: 320 x 180 pixels, 54 degrees high, at the ZED's place under the nose, without a screen or GL."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from skillwing.onboard.frames.pose_history import rotations
from skillwing.onboard.frames.vectors import Motion, add, to_world
from skillwing.onboard.topics.video import CameraHeader
from skillwing.sim_mujoco.camera.appearance import SUN, Appearance
from skillwing.sim_mujoco.camera.shading import placed, rays_to_sun, rows_at
from skillwing.sim_mujoco.compiled import compiled
from skillwing.sim_mujoco.sensors.depth_pictures import FOCAL, HEIGHT, WIDTH, ZED_MOUNT
from skillwing.sim_mujoco.world.rays import RayScene
from skillwing.sim_mujoco.world.world import World

Pixels = NDArray[np.intp]
Floats = NDArray[np.float32]
Faces = NDArray[np.int32]
Cast = Callable[[Pixels], tuple[Floats, Faces]]
"""Ray caster: from numbers of pixels, counted row by row, to inverse distances along the optical axis (n,) and to faces
(n,), -1 for the sky."""
Picture = NDArray[np.uint8]
FAR = 1000.0
"""Distance beyond which there is only sky [m]."""
_HALF = np.float32(0.5)
_CLOSE = np.float32(0.02)
"""Distance of the origin of rays to the sun from the surface, which would shade itself otherwise [m]."""


def camera_header(t: float, tilt: float) -> CameraHeader:
    """The description of a picture taken at `t` with the camera turned down by `tilt` [rad]."""
    return CameraHeader(
        t=t,
        width=WIDTH,
        height=HEIGHT,
        fx=FOCAL,
        fy=FOCAL,
        cx=WIDTH / 2,
        cy=HEIGHT / 2,
        mount=ZED_MOUNT,
        tilt=tilt,
    )


class Camera:
    """The camera in the static world. The same motion gives the same picture, bit by bit."""

    def __init__(self, world: World, rays: RayScene) -> None:
        self._rays, self._appearance = rays, Appearance(world)
        left = -(np.arange(WIDTH) + 0.5 - WIDTH / 2) / FOCAL
        up = -(np.arange(HEIGHT) + 0.5 - HEIGHT / 2) / FOCAL
        y, z = (each.ravel() for each in np.meshgrid(left, up))
        directions = np.stack([np.ones_like(y), y, z])
        length = np.linalg.norm(directions, axis=0)
        self._directions = (directions / length).astype(np.float32)
        self._length = length.astype(np.float32)

    def picture(self, motion: Motion, tilt: float = 0.0) -> Picture:
        """Picture (180, 320, 3) in red, green and blue from that position."""
        turn = rotations(np.array([motion.quaternion]))[0] @ _downward(tilt)
        directions = turn.astype(np.float32) @ self._directions
        origin = np.array(add(motion.position, to_world(motion.quaternion, ZED_MOUNT)), dtype=np.float32)

        def cast(pixels: Pixels) -> tuple[Floats, Faces]:
            ranges, faces = self._rays.faces(origin, rows_at(directions, pixels), FAR)
            inverse = np.divide(self._length.take(pixels), ranges, out=np.zeros_like(ranges), where=faces >= 0)
            return inverse, faces

        inverse, faces = trace(HEIGHT, WIDTH, self._appearance.surfaces, cast)
        places, away = placed(inverse.reshape(-1), directions, self._length, origin, np.float32(1.0 / FAR))
        return self._appearance.picture(faces, places, directions, away, self._sunny(faces, places), 1.0 / FOCAL)

    def _sunny(self, faces: Faces, places: Floats) -> Floats:
        """1 in the sun, 0 in the shade (height / 2, width / 2): cast for every other pixel of every other row that
        faces the sun. The pixels below and to the right have the same."""
        look = self._appearance
        starts, numbers = rays_to_sun(faces, places, look.facing_sun, look.normals, _CLOSE)
        found = np.zeros(faces.size // 4, dtype=np.float32)
        found[numbers] = ~self._rays.blocked(starts, np.broadcast_to(SUN, starts.shape), FAR)
        return found.reshape(HEIGHT // 2, WIDTH // 2)


def _downward(tilt: float) -> NDArray[np.float64]:
    """Rotation from camera axes to body axes; a positive tilt points the camera down."""
    c, s = math.cos(tilt), math.sin(tilt)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def trace(height: int, width: int, surface_of: NDArray[np.int32], cast: Cast) -> tuple[Floats, Faces]:
    """Inverse distances along the optical axis and faces (height, width), from a part of the rays; both sizes are even.

    A pixel between two pixels of one surface lies on it too; all others are cast. `surface_of` gives the surface of
    each face, and that of the sky as its last element.
    """
    pixels = np.arange(height * width, dtype=np.intp).reshape(height, width)
    inverse, face = np.empty(pixels.shape, dtype=np.float32), np.empty(pixels.shape, dtype=np.int32)

    def cast_into(chosen: Pixels) -> None:
        inverse.reshape(-1)[chosen], face.reshape(-1)[chosen] = cast(chosen)

    cast_into(pixels[::2, ::2].ravel())
    # First the columns between those of every other row, then the other rows.
    cast_into(_fill(inverse[::2].T, face[::2].T, pixels[::2].T, surface_of))
    cast_into(_fill(inverse, face, pixels, surface_of))
    return inverse, face


@compiled
def _fill(inverse: Floats, face: Faces, pixels: Pixels, surface_of: NDArray[np.int32]) -> Pixels:
    """Interpolate every other row of both (2 n, m) from the rows before and after it.

    Returns those of the `pixels` (2 n, m) in these rows that lie between two surfaces and have to be cast.
    """
    height, width = inverse.shape
    unknown, count = np.empty(height // 2 * width, dtype=np.intp), 0
    for row in range(1, height, 2):
        for column in range(width):
            face[row, column] = face[row - 1, column]
            if row + 1 < height:
                inverse[row, column] = _HALF * (inverse[row - 1, column] + inverse[row + 1, column])
            if row + 1 == height or surface_of[face[row - 1, column]] != surface_of[face[row + 1, column]]:
                unknown[count] = pixels[row, column]
                count += 1
    return unknown[:count]
