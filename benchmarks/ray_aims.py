"""Rays of `ray_choices.py`: places along a route, a sensor's rays there, and the ground."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import Final

import numpy as np

from skillwing.onboard.frames.pose_history import rotations
from skillwing.onboard.frames.vectors import Motion, Vector, add, to_world
from skillwing.onboard.sensor_data.directions import depth_directions, lidar_directions
from skillwing.sim_mujoco.autopilot.descent import STANDING_RANGE
from skillwing.sim_mujoco.sensors import depth_pictures, lidar
from skillwing.sim_mujoco.world.rays import Floats
from skillwing.sim_mujoco.world.triangles import Triangles
from skillwing.sim_mujoco.world.world import TERRAIN, World

Rays = tuple[Floats, Floats]
"""Origins (N, 3) or (3,), and unit directions (N, 3)."""
_ASIDE, _CLEAR = 1.0, 1.5
"""Largest distance from the route, and least distance from everything in plan [m]."""
_TURN, _TILT = 0.5, 0.08
"""Largest angle of the nose to the track, and the standard deviation of roll and pitch [rad]."""
_AIMED: Final = 2000
"""Rays at the ground from one place."""


def places(world: World, count: int) -> Iterator[Motion]:
    """Random motions of the drone along its route, clear of obstacles."""
    rng = np.random.default_rng(world.seed)
    legs = [(a, b) for a, b in pairwise(world.route) if a != b]
    lengths = np.array([math.dist(a, b) for a, b in legs])
    while count:
        a, b = legs[rng.choice(len(legs), p=lengths / lengths.sum())]
        x, y, z = (np.array(a) + rng.random() * np.subtract(b, a) + rng.uniform(-_ASIDE, _ASIDE, 3)).tolist()
        half = (math.atan2(b[1] - a[1], b[0] - a[0]) + rng.uniform(-_TURN, _TURN)) / 2
        roll, pitch = rng.normal(0.0, _TILT / 2, 2)
        c, s = math.cos(half), math.sin(half)
        attitude = np.array((c, c * roll - s * pitch, c * pitch + s * roll, s))  # heading first, then tilt
        w, i, j, k = (attitude / np.linalg.norm(attitude)).tolist()
        if all(each.footprint.distance_to((x, y)) > _CLEAR for each in world.obstacles):
            count -= 1
            yield Motion(0.0, (x, y, z), (0.0, 0.0, 0.0), (w, i, j, k), (0.0, 0.0, 0.0))


def picture_rays(motion: Motion) -> Rays:
    """Rays of the depth camera, one for each pixel."""
    directions = depth_directions(depth_pictures.depth_header(0.0)).reshape(-1, 3)
    return _from(motion, depth_pictures.ZED_MOUNT, directions / np.linalg.norm(directions, axis=1, keepdims=True))


def scan_rays(motion: Motion) -> Rays:
    """Rays of one revolution of the LiDAR, at rest."""
    return _from(motion, lidar.LIDAR_MOUNT, lidar_directions(lidar.COLUMNS, lidar.BEAMS).reshape(-1, 3))


def _from(motion: Motion, mount: Vector, in_body: Floats) -> Rays:
    turn = rotations(np.array([motion.quaternion]))[0].astype(np.float32)
    return np.array(add(motion.position, to_world(motion.quaternion, mount)), dtype=np.float32), in_body @ turn.T


class Ground:
    """Bare ground of a world, and rays that aim at it. Sides of one triangle only are the rim, and no edges."""

    def __init__(self, world: World) -> None:
        whole, self._rng = world.triangles(), np.random.default_rng(world.seed)
        bare = whole.labels == TERRAIN
        self.triangles = Triangles(whole.vertices, whole.faces[bare], whole.labels[bare])
        sides = np.sort(self.triangles.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        edges, owners = np.unique(sides, axis=0, return_counts=True)
        self._edges = whole.vertices[edges[owners == 2]]
        self._corners = whole.vertices[np.setdiff1d(edges, edges[owners == 1])]

    def anywhere(self, motion: Motion) -> Rays:
        """Rays from a place to evenly spread points."""
        points, _ = self.triangles.sample(1.0, self._rng)
        return self._at(points[self._rng.integers(len(points), size=_AIMED)], motion)

    def edges(self, motion: Motion) -> Rays:
        """Rays from a place to points on edges between two triangles."""
        a, b = self._edges[self._rng.integers(len(self._edges), size=_AIMED)].transpose(1, 0, 2)
        return self._at(a + (b - a) * self._rng.random((_AIMED, 1), dtype=np.float32), motion)

    def corners(self) -> Rays:
        """Rays straight down to each corner, from the height of the range-finder of a standing drone."""
        origins = self._corners.copy()
        origins[:, 2] += STANDING_RANGE
        return origins, np.tile(np.array((0.0, 0.0, -1.0), dtype=np.float32), (len(origins), 1))

    @staticmethod
    def _at(points: Floats, motion: Motion) -> Rays:
        origin = np.array(motion.position, dtype=np.float32)
        way = points - origin
        return origin, way / np.linalg.norm(way, axis=1, keepdims=True)
