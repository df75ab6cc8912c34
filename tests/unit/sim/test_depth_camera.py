"""The depth picture, most of whose pixels are computed from their neighbours, against a ray for each pixel."""

from __future__ import annotations

import math

import numpy as np
import pytest

from skillwing.sim_mujoco.frames.motion import Motion
from skillwing.sim_mujoco.frames.poses import rotations
from skillwing.sim_mujoco.frames.vectors import add, to_world
from skillwing.sim_mujoco.sensors.depth_camera import REACH, ZED_MOUNT, DepthCamera, depth_header
from skillwing.sim_mujoco.sensors.directions import depth_directions
from skillwing.sim_mujoco.sensors.rays import RayScene
from skillwing.sim_mujoco.world.world import make_world


@pytest.mark.parametrize("heading", [0.0, 0.8, 1.6, 3.0])
def test_computed_pixels_agree_with_rays(heading: float) -> None:
    rays = RayScene(make_world(2).triangles())
    quaternion = (math.cos(heading / 2), 0.0, 0.0, math.sin(heading / 2))
    motion = Motion(0.0, (12.0, 1.0, 4.0), (0.0, 0.0, 0.0), quaternion, (0.0, 0.0, 0.0))
    computed = DepthCamera(rays, np.random.default_rng(0)).true_depth(motion)

    directions = depth_directions(depth_header(0.0)).reshape(-1, 3)
    length = np.linalg.norm(directions, axis=1, keepdims=True)
    origin = np.array(add(motion.position, to_world(quaternion, ZED_MOUNT)), dtype=np.float32)
    turn = rotations(np.array([quaternion]))[0].astype(np.float32)
    ranges = rays.distances(origin, (directions / length) @ turn.T, REACH * float(length.max()))
    cast = (ranges / length[:, 0]).reshape(computed.shape)

    near = (cast > 0.0) & (cast < REACH)
    error = np.abs(computed - cast)[near] / cast[near]
    assert np.quantile(error, 0.999) < 0.005
    assert np.count_nonzero(near != ((computed > 0.0) & (computed < REACH))) < 0.001 * near.size
