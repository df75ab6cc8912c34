"""Stereo depth camera looking along the nose: 320 x 180 pixels, 15 Hz, 54 degrees high, up to 20 m."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from skillwing.sim_mujoco.frames.motion import Motion
from skillwing.sim_mujoco.frames.poses import rotations
from skillwing.sim_mujoco.frames.vectors import Vector, add, to_world
from skillwing.sim_mujoco.sensors.directions import depth_directions
from skillwing.sim_mujoco.sensors.infill import Pixels, inverse_depths
from skillwing.sim_mujoco.sensors.noise import NoiseTable
from skillwing.sim_mujoco.sensors.rays import RayScene
from skillwing.sim_mujoco.topics import DepthHeader

ZED_MOUNT: Vector = (0.3, 0.0, -0.05)
"""Where the camera sits on the drone, FLU [m]."""
WIDTH, HEIGHT = 320, 180
PERIOD = 1 / 15
REACH, NEAREST = 20.0, 0.4
FOCAL = HEIGHT / 2 / math.tan(math.radians(54.0) / 2)
"""Focal length [px], the same in both directions; the optical axis passes through the image's centre."""
_NOISE = 0.0015
"""Depth noise grows with the square of the depth, as disparity noise does: sigma = 0.0015 z^2 [m]."""


def depth_header(t: float) -> DepthHeader:
    """The description of a picture taken at `t`."""
    return DepthHeader(
        t=t, width=WIDTH, height=HEIGHT, fx=FOCAL, fy=FOCAL, cx=WIDTH / 2, cy=HEIGHT / 2, mount=ZED_MOUNT
    )


class DepthCamera:
    """One picture at a time, of the static world."""

    def __init__(self, rays: RayScene, rng: np.random.Generator) -> None:
        self._rays, self._noise = rays, NoiseTable(rng)
        directions = depth_directions(depth_header(0.0))
        length = np.linalg.norm(directions, axis=-1, keepdims=True)
        self._rays_in_body = directions / length
        self._range_per_depth = length[..., 0].astype(np.float32)
        self._reach = REACH * float(length.max())

    def picture(self, motion: Motion) -> NDArray[np.float32]:
        """Depth along the optical axis (180, 320) [m], 0 = no return."""
        depth = self.true_depth(motion)
        depth += np.float32(_NOISE) * depth * depth * self._noise.draw(depth.size).reshape(depth.shape)
        depth[(depth < NEAREST) | (depth > REACH)] = 0.0
        return depth

    def true_depth(self, motion: Motion) -> NDArray[np.float32]:
        """The same without noise and limits of the sensor."""
        turn = rotations(np.array([motion.quaternion]))[0].astype(np.float32)
        origin = np.array(add(motion.position, to_world(motion.quaternion, ZED_MOUNT)), dtype=np.float32)

        def cast(rows: Pixels, columns: Pixels) -> NDArray[np.float32]:
            ranges = self._rays.distances(origin, self._rays_in_body[rows, columns] @ turn.T, self._reach)
            return np.divide(self._range_per_depth[rows, columns], ranges, out=ranges, where=ranges > 0.0)

        inverse = inverse_depths(HEIGHT, WIDTH, cast)
        return np.divide(np.float32(1.0), inverse, out=np.zeros_like(inverse), where=inverse > 0.0)
