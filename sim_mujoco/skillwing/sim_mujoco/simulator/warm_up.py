"""Compilation of the sensors' loops before a flight begins."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from skillwing.onboard.frames.vectors import Motion
from skillwing.sim_mujoco.camera.camera import Camera
from skillwing.sim_mujoco.sensors.depth_camera import DepthCamera
from skillwing.sim_mujoco.sensors.instruments import RangeFinder
from skillwing.sim_mujoco.sensors.lidar import PERIOD, Lidar
from skillwing.sim_mujoco.world.rays import RayScene
from skillwing.sim_mujoco.world.world import make_world


@cache
def compile_loops() -> None:
    """Take one measurement of each sensor in another world, so that no loop is compiled in flight.

    The first process on a machine takes seconds for it. Later ones read the machine code from the cache.
    """
    world, rng = make_world(0), np.random.default_rng(0)
    rays = RayScene(world.triangles())
    motion = Motion(0.0, world.route[0], (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    Lidar(rays, rng).scan([motion, replace(motion, t=PERIOD)], 0.0, PERIOD)
    DepthCamera(rays, rng).picture(motion)
    RangeFinder(rays, rng).measure(motion)
    Camera(world, rays).picture(motion)
