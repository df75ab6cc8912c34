"""The RGB camera: 320 x 180 pixels, 54 degrees high, at the ZED's place under the nose, without a screen or GL."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from skillwing.onboard.frames.motion import Motion
from skillwing.onboard.frames.poses import rotations
from skillwing.onboard.frames.vectors import add, to_world
from skillwing.onboard.topics import CameraHeader
from skillwing.sim_mujoco.camera.appearance import SUN, Appearance
from skillwing.sim_mujoco.sensors.depth_camera import FOCAL, HEIGHT, WIDTH, ZED_MOUNT
from skillwing.sim_mujoco.world.rays import RayScene
from skillwing.sim_mujoco.world.world import World

Numbers = NDArray[np.intp]
Pixels = NDArray[np.intp]
Floats = NDArray[np.float32]
Faces = NDArray[np.int32]
Cast = Callable[[Pixels], tuple[Floats, Faces]]
"""Casts rays: from numbers of pixels, counted row by row, to inverse distances along the optical axis (n,) and faces
(n,), -1 for the sky."""
Picture = NDArray[np.uint8]
FAR = 1000.0
"""What is farther away is sky [m]."""
_GREY = np.rint(255.0 * np.linspace(0.0, 1.0, 2048) ** (1 / 1.15)).astype(np.uint8)
"""What a pixel's value becomes of light between 0 and 1."""
_CLOSE = np.float32(0.02)
"""Rays to the sun begin so far before the surface, or it would shade itself [m]."""


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
    """One picture at a time, of the static world. The same motion gives the same picture, bit by bit."""

    def __init__(self, world: World, rays: RayScene) -> None:
        self._rays, self._look = rays, Appearance(world)
        left = -(np.arange(WIDTH) + 0.5 - WIDTH / 2) / FOCAL
        up = -(np.arange(HEIGHT) + 0.5 - HEIGHT / 2) / FOCAL
        y, z = (each.ravel() for each in np.meshgrid(left, up))
        directions = np.stack([np.ones_like(y), y, z])
        length = np.linalg.norm(directions, axis=0)
        self._directions = (directions / length).astype(np.float32)
        self._length = length.astype(np.float32)

    def picture(self, motion: Motion, tilt: float = 0.0) -> Picture:
        """Red, green and blue (180, 320, 3) of what is seen from there."""
        turn = rotations(np.array([motion.quaternion]))[0] @ _downward(tilt)
        directions = turn.astype(np.float32) @ self._directions
        origin = np.array(add(motion.position, to_world(motion.quaternion, ZED_MOUNT)), dtype=np.float32)

        def cast(pixels: Pixels) -> tuple[Floats, Faces]:
            ranges, faces = self._rays.faces(origin, directions.take(pixels, axis=1).T, FAR)
            inverse = np.divide(self._length.take(pixels), ranges, out=np.zeros_like(ranges), where=faces >= 0)
            return inverse, faces

        inverse, faces = trace(HEIGHT, WIDTH, self._look.surfaces, cast)
        away = self._length / np.maximum(inverse.ravel(), np.float32(1.0 / FAR))
        places = directions * away
        places += origin[:, None]
        seen = faces.ravel().astype(np.intp)
        light = self._look.light(seen, places, directions, away, self._sunny(seen, places), 1.0 / FOCAL)
        light *= np.float32(len(_GREY) - 1)
        levels = np.clip(light, 0, len(_GREY) - 1).astype(np.uint16)
        return np.stack([_GREY.take(each) for each in levels], axis=-1).reshape(HEIGHT, WIDTH, 3)

    def _sunny(self, faces: Numbers, places: Floats) -> Floats:
        """1 where the sun shines, 0 in the shade (N,): found for every other pixel of every other row that faces it,
        and taken over by its neighbours below and to the right."""
        every_other = faces.reshape(HEIGHT, WIDTH)[::2, ::2].ravel()
        asked = np.flatnonzero(self._look.facing_sun.take(every_other))
        starts = places.reshape(3, HEIGHT, WIDTH)[:, ::2, ::2].reshape(3, -1).take(asked, axis=1).T
        starts += _CLOSE * self._look.normals.take(every_other.take(asked), axis=0)
        towards = np.broadcast_to(SUN, starts.shape)
        found = np.zeros(len(every_other), dtype=np.float32)
        found[asked] = self._rays.distances(starts, towards, FAR) == 0.0
        sunny = np.empty((HEIGHT // 2, 2, WIDTH // 2, 2), dtype=np.float32)
        sunny[:] = found.reshape(HEIGHT // 2, 1, WIDTH // 2, 1)
        return sunny.ravel()


def _downward(tilt: float) -> NDArray[np.float64]:
    """Turns camera axes into body axes: a positive tilt lowers the nose."""
    c, s = math.cos(tilt), math.sin(tilt)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def trace(height: int, width: int, surface_of: NDArray[np.int32], cast: Cast) -> tuple[Floats, Faces]:
    """Inverse distances along the optical axis and faces (height, width); both measures are even.

    `surface_of` gives the surface that a face belongs to, and that of the sky as its last element.
    """
    pixels = np.arange(height * width, dtype=np.intp).reshape(height, width)
    inverse, face = np.empty(pixels.shape, dtype=np.float32), np.empty(pixels.shape, dtype=np.int32)

    def cast_into(chosen: Pixels) -> None:
        inverse.reshape(-1)[chosen], face.reshape(-1)[chosen] = cast(chosen)

    cast_into(pixels[::2, ::2].ravel())
    # First the columns between those of every other row, then the other rows.
    cast_into(pixels[::2, 1::2].T[_fill(inverse[::2].T, face[::2].T, surface_of)])
    cast_into(pixels[1::2][_fill(inverse, face, surface_of)])
    return inverse, face


def _fill(inverse: Floats, face: Faces, surface_of: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Fill in every other row of both (2 n, m) from those before and after it, and tell where (n, m) of these rows that
    does not hold, because there is another surface on either side."""
    known = face[::2]
    inverse[1:-1:2] = np.float32(0.5) * (inverse[:-2:2] + inverse[2::2])
    face[1::2] = known
    surface = surface_of.take(known)
    unknown = np.ones(surface.shape, dtype=np.bool_)
    np.not_equal(surface[:-1], surface[1:], out=unknown[:-1])
    return unknown
