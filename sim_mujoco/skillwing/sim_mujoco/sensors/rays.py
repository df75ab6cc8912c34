"""Rays against the static world (Embree): distances only, a fresh origin for every ray."""

from __future__ import annotations

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from numpy.typing import NDArray

from skillwing.sim_mujoco.world.triangles import Triangles


class RayScene:
    """Triangles that do not move, prepared for ray queries."""

    def __init__(self, triangles: Triangles) -> None:
        self._scene = EmbreeScene()
        self._mesh = TriangleMesh(self._scene, triangles.vertices, triangles.faces)

    def distances(
        self, origins: NDArray[np.float32], directions: NDArray[np.float32], reach: float
    ) -> NDArray[np.float32]:
        """Distances (N,) [m] along unit directions (N, 3) from origins (N, 3) or (3,); 0 where nothing is in reach."""
        starts = np.ascontiguousarray(np.broadcast_to(origins, directions.shape), dtype=np.float32)
        hits = self._scene.run(starts, np.ascontiguousarray(directions), dists=reach, query="DISTANCE")
        hits[hits >= reach] = 0.0
        return hits
