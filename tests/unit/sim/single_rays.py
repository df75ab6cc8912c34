"""Reference for packets of rays: the same questions, answered by `embreex` ray by ray and by NumPy."""

from __future__ import annotations

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from skillwing.sim_mujoco.world.triangles import Triangles


class SingleRays:
    """Triangles as in `RayScene`; origins (N, 3)."""

    def __init__(self, triangles: Triangles) -> None:
        self._scene = EmbreeScene(robust=False)
        self._mesh = TriangleMesh(self._scene, triangles.vertices, triangles.faces)

    def distances(self, origins: np.ndarray, directions: np.ndarray, reach: float, nothing: float = 0.0) -> np.ndarray:
        hits = self._scene.run(origins, directions, dists=reach, query="DISTANCE")
        hits[hits >= reach] = nothing
        return hits

    def faces(self, origins: np.ndarray, directions: np.ndarray, reach: float) -> tuple[np.ndarray, np.ndarray]:
        found = self._scene.run(origins, directions, dists=reach, output=True)
        distances, faces = found["tfar"], found["primID"].astype(np.int32)
        missed = (faces < 0) | (distances >= reach)
        distances[missed], faces[missed] = 0.0, -1
        return distances, faces

    def hits(self, origins: np.ndarray, directions: np.ndarray, reach: float) -> tuple[np.ndarray, np.ndarray]:
        found = self._scene.run(origins, directions, dists=reach, output=True)
        distances, normals = found["tfar"], found["Ng"]
        missed = distances >= reach
        along, lengths = np.abs(_dots(normals, directions)), np.sqrt(_dots(normals, normals))
        distances[missed], along[missed], lengths[missed] = 0.0, 0.0, 1.0
        return distances, np.divide(along, lengths)


def _dots(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    x, y, z = np.multiply(one, other).T
    return x + y + z
