"""Ray casting against the static world (Embree), with an origin for every ray."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from skillwing.sim_mujoco.world import embree
from skillwing.sim_mujoco.world.embree import Floats, TriangleScene
from skillwing.sim_mujoco.world.triangles import Triangles


class RayScene:
    """Triangles that do not move, prepared for ray queries.

    Origins are (3,) for all rays, or (M, 3) for N rays in turn: each origin belongs to N / M directions.

    Embree's robust mode is off. It would stop rays from passing between two triangles that share an edge, but every ray
    would take longer. `benchmarks/ray_choices.py` measures both.
    """

    def __init__(self, triangles: Triangles, *, robust: bool = False) -> None:
        self._scene = TriangleScene(triangles, robust=robust)

    def __deepcopy__(self, memo: dict[int, Any]) -> RayScene:
        """The scene itself, because it never changes. So a copy of a simulator shares its world."""
        del memo
        return self

    def distances(self, origins: Floats, directions: Floats, reach: float, nothing: float = 0.0) -> Floats:
        """Distances (N,) [m] along unit directions (N, 3) from the origins; `nothing` where nothing is in reach."""
        return embree.cast_distances(
            self._scene.address, *_rows(origins, directions), np.float32(reach), np.float32(nothing)
        )

    def faces(self, origins: Floats, directions: Floats, reach: float) -> tuple[Floats, NDArray[np.int32]]:
        """Distances as above, and the number of the triangle that was hit; 0 and -1 for none."""
        return embree.cast_faces(self._scene.address, *_rows(origins, directions), np.float32(reach))

    def hits(self, origins: Floats, directions: Floats, reach: float) -> tuple[Floats, Floats]:
        """Distances as above, and the cosine of the incidence: 1 at a right angle, 0 for grazing rays and no hit."""
        return embree.cast_hits(self._scene.address, *_rows(origins, directions), np.float32(reach))

    def blocked(self, origins: Floats, directions: Floats, reach: float) -> NDArray[np.bool_]:
        """Mask (N,) of rays with anything in reach. It takes less time than the distance."""
        return embree.cast_blocked(self._scene.address, *_rows(origins, directions), np.float32(reach))


def _rows(origins: Floats, directions: Floats) -> tuple[Floats, Floats]:
    """Both as rows of three in memory, which the compiled loops take."""
    return (
        np.ascontiguousarray(origins, dtype=np.float32).reshape(-1, 3),
        np.ascontiguousarray(directions, dtype=np.float32),
    )
