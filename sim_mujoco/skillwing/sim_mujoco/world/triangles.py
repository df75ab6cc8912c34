"""A triangle soup with labels, and evenly spread points on it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Triangles:
    """A triangle soup in the world frame: vertices (N, 3) float32 [m], faces (M, 3) int32, one label per face."""

    vertices: NDArray[np.float32]
    faces: NDArray[np.int32]
    labels: NDArray[np.int8]

    def corners(self) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
        """The three corner arrays, each (M, 3)."""
        a, b, c = self.vertices[self.faces].transpose(1, 0, 2)
        return a, b, c

    def sample(self, step: float, rng: np.random.Generator) -> tuple[NDArray[np.float32], NDArray[np.int8]]:
        """Points (K, 3) spread evenly over the surfaces, about one per `step` squared, and their labels (K,)."""
        a, b, c = self.corners()
        area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
        face = np.repeat(np.arange(len(area)), rng.poisson(area / step**2))
        u, v = rng.random((2, len(face), 1), dtype=np.float32)
        outside = u + v > 1
        u, v = np.where(outside, 1 - u, u), np.where(outside, 1 - v, v)
        return a[face] + (b - a)[face] * u + (c - a)[face] * v, self.labels[face]
