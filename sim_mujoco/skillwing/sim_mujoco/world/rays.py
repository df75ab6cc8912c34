"""Ray casting against the static world (Embree), with an origin for every ray."""

from __future__ import annotations

from typing import Any

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from numpy.typing import NDArray

from skillwing.sim_mujoco.world.triangles import Triangles

Floats = NDArray[np.float32]


class RayScene:
    """Triangles that do not move, prepared for ray queries.

    Embree's robust mode is off. It would stop rays from passing between two triangles that share an edge, but every ray
    would take longer. `benchmarks/ray_choices.py` measures both.
    """

    def __init__(self, triangles: Triangles) -> None:
        self._scene = EmbreeScene(robust=False)
        self._mesh = TriangleMesh(self._scene, triangles.vertices, triangles.faces)

    def __deepcopy__(self, memo: dict[int, Any]) -> RayScene:
        """The scene itself, because it never changes. So a copy of a simulator shares its world."""
        del memo
        return self

    def distances(self, origins: Floats, directions: Floats, reach: float, nothing: float = 0.0) -> Floats:
        """Distances (N,) [m] along unit directions (N, 3) from origins (N, 3) or (3,); `nothing` where nothing is in
        reach."""
        starts = np.broadcast_to(origins, directions.shape)
        hits = self._scene.run(starts, np.ascontiguousarray(directions), dists=reach, query="DISTANCE")
        hits[hits >= reach] = nothing
        return hits

    def faces(self, origins: Floats, directions: Floats, reach: float) -> tuple[Floats, NDArray[np.int32]]:
        """Distances as above, and the number of the triangle that was hit; -1 for none."""
        starts = np.broadcast_to(origins, directions.shape)
        found = self._scene.run(starts, np.ascontiguousarray(directions), dists=reach, output=True)
        distances, faces = found["tfar"], found["primID"].astype(np.int32)
        missed = (faces < 0) | (distances >= reach)
        distances[missed], faces[missed] = 0.0, -1
        return distances, faces

    def hits(self, origins: Floats, directions: Floats, reach: float) -> tuple[Floats, Floats]:
        """Distances as above, and the cosine of the incidence: 1 at a right angle, 0 for grazing rays and no hit."""
        starts = np.broadcast_to(origins, directions.shape)
        found = self._scene.run(starts, np.ascontiguousarray(directions), dists=reach, output=True)
        distances, normals = found["tfar"], found["Ng"]
        missed = distances >= reach
        along = np.abs(_dots(normals, directions))
        lengths = np.sqrt(_dots(normals, normals))
        distances[missed], along[missed], lengths[missed] = 0.0, 0.0, 1.0
        return distances, np.divide(along, lengths)


def _dots(one: Floats, other: Floats) -> Floats:
    """Dot products (N,) of rows (N, 3); faster than einsum for such short rows."""
    x, y, z = np.multiply(one, other).T
    return x + y + z
