"""The RGB camera: 320 x 180 pixels, 54 degrees high, at the ZED's place under the nose, without a screen or GL."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from skillwing.sim_mujoco.camera.appearance import SUN, Appearance, sky
from skillwing.sim_mujoco.camera.sparse import Faces, Floats, Pixels, trace
from skillwing.sim_mujoco.frames.motion import Motion
from skillwing.sim_mujoco.frames.poses import rotations
from skillwing.sim_mujoco.frames.vectors import add, to_world
from skillwing.sim_mujoco.sensors.depth_camera import FOCAL, HEIGHT, WIDTH, ZED_MOUNT
from skillwing.sim_mujoco.sensors.rays import RayScene
from skillwing.sim_mujoco.topics import CameraHeader
from skillwing.sim_mujoco.world.world import World

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
        y, z = np.meshgrid(left, up)
        directions = np.stack([np.ones_like(y), y, z], axis=-1)
        length = np.linalg.norm(directions, axis=-1, keepdims=True)
        self._directions = directions.astype(np.float32)
        self._unit = (directions / length).astype(np.float32)
        self._length = length[..., 0].astype(np.float32)
        row, column = np.divmod(np.arange(HEIGHT * WIDTH), WIDTH)
        self._lit_like = row // 2 * 2 * WIDTH + column // 2 * 2
        """Of each pixel the one of which the sun is asked: every other one of every other row."""

    def picture(self, motion: Motion, tilt: float = 0.0) -> Picture:
        """Red, green and blue (180, 320, 3) of what is seen from there."""
        turn = rotations(np.array([motion.quaternion]))[0] @ _downward(tilt)
        turn = turn.astype(np.float32)
        origin = np.array(add(motion.position, to_world(motion.quaternion, ZED_MOUNT)), dtype=np.float32)

        def cast(rows: Pixels, columns: Pixels) -> tuple[Floats, Faces]:
            ranges, faces = self._rays.faces(origin, self._unit[rows, columns] @ turn.T, FAR)
            inverse = np.divide(self._length[rows, columns], ranges, out=np.zeros_like(ranges), where=faces >= 0)
            return inverse, faces

        inverse, faces = trace(HEIGHT, WIDTH, self._look.surfaces, cast)
        directions = self._directions.reshape(-1, 3) @ turn.T
        light = self._shade(origin, directions, inverse, faces)
        light *= np.float32(len(_GREY) - 1)
        levels = np.clip(light, 0, len(_GREY) - 1).astype(np.uint16)
        return np.take(_GREY, levels).reshape(HEIGHT, WIDTH, 3)

    def _shade(self, origin: Floats, directions: Floats, inverse: Floats, faces: Faces) -> Floats:
        flat = faces.ravel()
        seen = np.flatnonzero(flat >= 0)
        light = np.empty_like(directions)
        hidden = np.flatnonzero(flat < 0)
        light[hidden] = sky(np.take(directions, hidden, axis=0))
        depth = np.float32(1.0) / inverse.ravel()[seen]
        places = np.take(directions, seen, axis=0)
        normals = np.take(self._look.normals, flat[seen], axis=0)
        normals *= -np.sign(np.einsum("ij,ij->i", normals, places))[:, None]
        places *= depth[:, None]
        places += origin
        sun = self._sunny(seen, places, normals)
        away = depth * self._length.ravel()[seen]
        light[seen] = self._look.colours(flat[seen], places, normals, sun, away, 1.0 / FOCAL)
        return light

    def _sunny(self, seen: NDArray[np.intp], places: Floats, normals: Floats) -> Floats:
        """1 where the sun shines, 0 in the shade: found for every other pixel of every other row that faces it, and
        taken over by its neighbours below and to the right."""
        everywhere = np.zeros(HEIGHT * WIDTH, dtype=np.float32)
        sources = self._lit_like.take(seen)
        asked = np.flatnonzero((sources == seen) & (normals @ SUN > 0.0))
        starts = (places[asked] + normals[asked] * _CLOSE).astype(np.float32)
        towards = np.ascontiguousarray(np.broadcast_to(SUN, starts.shape))
        everywhere[seen[asked]] = self._rays.distances(starts, towards, FAR) == 0.0
        return everywhere.take(sources)


def _downward(tilt: float) -> NDArray[np.float64]:
    """Turns camera axes into body axes: a positive tilt lowers the nose."""
    c, s = math.cos(tilt), math.sin(tilt)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
