"""Rays against the world and the other drones in it, which move."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from copy import deepcopy
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from skillwing.onboard.frames.extent import TIP_RADIUS
from skillwing.onboard.frames.vectors import Quaternion, Vector, axes
from skillwing.sim_mujoco.world.embree import Floats
from skillwing.sim_mujoco.world.rays import RayScene

Pose: TypeAlias = tuple[Vector, Quaternion]
"""Position of the centre and attitude."""
Part: TypeAlias = tuple[Vector, Vector, float]
"""An ellipsoid: centre and semi-axes in the body's frame [m], turned about the body's z [rad]."""

_ARM = 0.5665
_ANGLES = tuple(math.radians(30.0 + 60.0 * arm) for arm in range(6))
PARTS: tuple[Part, ...] = (
    ((0.0, 0.0, 0.0), (0.25, 0.25, 0.12), 0.0),
    *(((_ARM / 2 * math.cos(a), _ARM / 2 * math.sin(a), 0.01), (_ARM / 2, 0.03, 0.03), a) for a in _ANGLES),
    *(((_ARM * math.cos(a), _ARM * math.sin(a), 0.03), (0.05, 0.05, 0.05), 0.0) for a in _ANGLES),
    ((0.0, 0.4, -0.55), (0.4, 0.025, 0.025), 0.0),
    ((0.0, -0.4, -0.55), (0.4, 0.025, 0.025), 0.0),
)
"""Visible parts of a drone: hub, arms, motors and skids. Turning blades let nearly all rays pass."""


class VehicleRays(RayScene):
    """A scene with the other drones, as ellipsoids where they are at the time of the query.

    scene: the world; it is shared. others: poses of the other drones now. Distances and hits see the drones. Faces, and
    what blocks a ray, belong to the world alone: the RGB camera does not see other drones.
    """

    def __init__(self, scene: RayScene, others: Callable[[], Sequence[Pose]]) -> None:
        self._scene = scene._scene
        self._others = others

    def __deepcopy__(self, memo: dict[int, Any]) -> VehicleRays:
        return VehicleRays(self, deepcopy(self._others, memo))

    def distances(self, origins: Floats, directions: Floats, reach: float, nothing: float = 0.0) -> Floats:
        found = super().distances(origins, directions, reach, np.inf)
        for rays, distances, _ in self._drones(origins, directions, reach):
            found[rays] = np.minimum(found[rays], distances)
        return np.where(np.isinf(found), np.float32(nothing), found)

    def hits(self, origins: Floats, directions: Floats, reach: float) -> tuple[Floats, Floats]:
        found, cosines = super().hits(origins, directions, reach)
        for rays, distances, squareness in self._drones(origins, directions, reach):
            nearer = (found[rays] == 0.0) | (distances < found[rays])
            found[rays[nearer]], cosines[rays[nearer]] = distances[nearer], squareness[nearer]
        return found, cosines

    def _drones(
        self, origins: Floats, directions: Floats, reach: float
    ) -> list[tuple[NDArray[np.intp], Floats, Floats]]:
        """Hits on each drone that is hit: numbers of the rays (n,), their distances (n,) [m] and cosines (n,)."""
        starts = np.asarray(origins, dtype=np.float64).reshape(-1, 3)
        found = [_hits_on(pose, starts, directions, reach) for pose in self._others()]
        return [each for each in found if each is not None]


def _hits_on(
    pose: Pose, starts: NDArray[np.float64], directions: Floats, reach: float
) -> tuple[NDArray[np.intp], Floats, Floats] | None:
    """Hits on one drone, as above; None if there are none. starts: (M, 3), each of N / M directions (N, 3) in turn."""
    towards = np.array(pose[0]) - starts
    if len(directions) == 0 or np.linalg.norm(towards, axis=1).min() > reach + TIP_RADIUS:
        return None
    share = len(directions) // len(starts)
    squares = np.repeat(np.einsum("ij,ij->i", towards, towards), share)
    along = np.einsum("kij,kj->ki", directions.reshape(len(starts), share, 3), towards).ravel()
    near = np.flatnonzero((along > -TIP_RADIUS) & (squares - along * along < TIP_RADIUS**2))
    if len(near) == 0:
        return None
    turn = np.array(axes(pose[1])).T  # body to world
    inside = -(towards[near // share] @ turn), directions[near].astype(np.float64) @ turn
    distances, cosines = _nearest_part(*inside)
    hit = np.flatnonzero(distances < reach)
    return (near[hit], distances[hit].astype(np.float32), cosines[hit].astype(np.float32)) if len(hit) else None


def _nearest_part(
    origins: NDArray[np.float64], directions: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Distances (n,) to the nearest part, infinite for none, and cosines of incidence (n,). Rays are in FLU."""
    distances, cosines = np.full(len(origins), np.inf), np.zeros(len(origins))
    for centre, semi_axes, yaw in PARTS:
        # The map that turns the ellipsoid into a unit sphere.
        level = np.array([[math.cos(yaw), math.sin(yaw), 0.0], [-math.sin(yaw), math.cos(yaw), 0.0], [0.0, 0.0, 1.0]])
        to_sphere = (level.T / np.array(semi_axes)).T
        o, d = (origins - np.array(centre)) @ to_sphere.T, directions @ to_sphere.T
        a, b, c = (np.einsum("ij,ij->i", *pair) for pair in ((d, d), (o, d), (o, o)))
        root = b * b - a * (c - 1.0)
        reached = (-b - np.sqrt(np.maximum(root, 0.0))) / a
        hit = np.flatnonzero((root > 0.0) & (reached > 0.0) & (reached < distances))
        normals = (o[hit] + reached[hit, None] * d[hit]) @ to_sphere
        facing = np.abs(np.einsum("ij,ij->i", normals, directions[hit]))
        distances[hit], cosines[hit] = reached[hit], facing / np.linalg.norm(normals, axis=1)
    return distances, cosines
