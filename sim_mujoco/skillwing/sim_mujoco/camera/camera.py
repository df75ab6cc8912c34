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
from skillwing.sim_mujoco.sensors.depth_camera import FOCAL, HEIGHT, WIDTH, ZED_MOUNT
from skillwing.sim_mujoco.world.rays import RayScene
from skillwing.sim_mujoco.world.world import World

Numbers = NDArray[np.intp]
Pixels = NDArray[np.intp]
Floats = NDArray[np.float32]
Faces = NDArray[np.int32]
Cast = Callable[[Pixels], tuple[Floats, Faces]]
"""Ray caster: from numbers of pixels, counted row by row, to inverse distances along the optical axis (n,) and to faces
(n,), -1 for the sky."""
Picture = NDArray[np.uint8]
FAR = 1000.0
"""Distance beyond which there is only sky [m]."""
_GREY = np.rint(255.0 * np.linspace(0.0, 1.0, 2048) ** (1 / 1.15)).astype(np.uint8)
"""Values of pixels for light between 0 and 1."""
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
            ranges, faces = self._rays.faces(origin, directions.take(pixels, axis=1).T, FAR)
            inverse = np.divide(self._length.take(pixels), ranges, out=np.zeros_like(ranges), where=faces >= 0)
            return inverse, faces

        inverse, faces = trace(HEIGHT, WIDTH, self._appearance.surfaces, cast)
        away = self._length / np.maximum(inverse.ravel(), np.float32(1.0 / FAR))
        places = directions * away
        places += origin[:, None]
        seen = faces.ravel().astype(np.intp)
        light = self._appearance.light(seen, places, directions, away, self._sunny(seen, places), 1.0 / FOCAL)
        light *= np.float32(len(_GREY) - 1)
        levels = np.clip(light, 0, len(_GREY) - 1).astype(np.uint16)
        return np.stack([_GREY.take(each) for each in levels], axis=-1).reshape(HEIGHT, WIDTH, 3)

    def _sunny(self, faces: Numbers, places: Floats) -> Floats:
        """1 in the sun, 0 in the shade (N,): cast for every other pixel of every other row that faces the sun, and
        copied to its neighbours below and to the right."""
        every_other = faces.reshape(HEIGHT, WIDTH)[::2, ::2].ravel()
        asked = np.flatnonzero(self._appearance.facing_sun.take(every_other))
        starts = places.reshape(3, HEIGHT, WIDTH)[:, ::2, ::2].reshape(3, -1).take(asked, axis=1).T
        starts += _CLOSE * self._appearance.normals.take(every_other.take(asked), axis=0)
        towards = np.broadcast_to(SUN, starts.shape)
        found = np.zeros(len(every_other), dtype=np.float32)
        found[asked] = ~self._rays.blocked(starts, towards, FAR)
        sunny = np.empty((HEIGHT // 2, 2, WIDTH // 2, 2), dtype=np.float32)
        sunny[:] = found.reshape(HEIGHT // 2, 1, WIDTH // 2, 1)
        return sunny.ravel()


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
    cast_into(pixels[::2, 1::2].T[_fill(inverse[::2].T, face[::2].T, surface_of)])
    cast_into(pixels[1::2][_fill(inverse, face, surface_of)])
    return inverse, face


def _fill(inverse: Floats, face: Faces, surface_of: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Interpolate every other row of both (2 n, m) from the rows before and after it.

    Returns a mask (n, m) of the pixels in these rows that lie between two surfaces and have to be cast.
    """
    known = face[::2]
    inverse[1:-1:2] = np.float32(0.5) * (inverse[:-2:2] + inverse[2::2])
    face[1::2] = known
    surface = surface_of.take(known)
    unknown = np.ones(surface.shape, dtype=np.bool_)
    np.not_equal(surface[:-1], surface[1:], out=unknown[:-1])
    return unknown
