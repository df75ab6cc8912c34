"""Distance from a point to the nearest surface, for judges."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from skillwing.sim_mujoco.frames.vectors import Vector
from skillwing.sim_mujoco.world.triangles import Triangles

_CELL = 4.0


class Clearance:
    """Exact distances from points to the triangles that do not carry the label `ignore`.

    Triangles are looked at in groups, by cubes of 4 m that their middles lie in: of a village only what is near counts.
    """

    def __init__(self, triangles: Triangles, ignore: int) -> None:
        keep = np.flatnonzero(triangles.labels != ignore)
        a, b, c = triangles.corners()
        cells = np.floor((a[keep] + b[keep] + c[keep]) / (3.0 * _CELL)).astype(np.int64)
        _, group = np.unique(cells, axis=0, return_inverse=True)
        keep = keep[np.argsort(group, kind="stable")]
        a, b, c = (corner[keep].astype(np.float64) for corner in (a, b, c))
        self._a, self._ab, self._ac = a, b - a, c - a
        self._counts = np.bincount(group)
        starts = np.cumsum(self._counts) - self._counts
        self._low = np.minimum.reduceat(np.minimum(np.minimum(a, b), c), starts) if len(keep) else a
        self._high = np.maximum.reduceat(np.maximum(np.maximum(a, b), c), starts) if len(keep) else a

    def distance(self, point: Vector, reach: float = 15.0) -> float:
        """Distance [m] from `point` to the nearest surface, or `reach` where none is nearer."""
        p = np.array(point)
        outside = np.maximum(np.maximum(self._low - p, p - self._high), 0.0)
        farthest = np.maximum(np.abs(p - self._low), np.abs(self._high - p))
        # All of a group lies nearer than the farthest corner of its box, so no other needs to be looked at beyond that.
        within = min(reach * reach, float(np.einsum("ij,ij->i", farthest, farthest).min(initial=np.inf)))
        near = np.flatnonzero(np.repeat(np.einsum("ij,ij->i", outside, outside) <= within, self._counts))
        if len(near) == 0:
            return reach
        away = p - _closest_points(p, self._a[near], self._ab[near], self._ac[near])
        return min(reach, float(np.sqrt(np.einsum("ij,ij->i", away, away).min())))


def _closest_points(
    p: NDArray[np.float64], a: NDArray[np.float64], ab: NDArray[np.float64], ac: NDArray[np.float64]
) -> NDArray[np.float64]:
    """The point of each triangle (a, a + ab, a + ac) nearest to `p`: its plane's foot point or one on an edge."""
    ap = p - a
    d1, d2 = _dots(ab, ap), _dots(ac, ap)
    g11, g12, g22 = _dots(ab, ab), _dots(ab, ac), _dots(ac, ac)
    determinant = np.maximum(g11 * g22 - g12 * g12, 1e-18)
    u, v = (g22 * d1 - g12 * d2) / determinant, (g11 * d2 - g12 * d1) / determinant
    foot = a + u[:, None] * ab + v[:, None] * ac
    on_edges = np.stack([_on_edge(p, a, ab), _on_edge(p, a, ac), _on_edge(p, a + ab, ac - ab)])
    gaps = np.einsum("kij,kij->ki", on_edges - p, on_edges - p)
    edge = on_edges[gaps.argmin(axis=0), np.arange(len(a))]
    inside = (u >= 0) & (v >= 0) & (u + v <= 1)
    return np.where(inside[:, None], foot, edge)


def _on_edge(p: NDArray[np.float64], start: NDArray[np.float64], edge: NDArray[np.float64]) -> NDArray[np.float64]:
    along = np.clip(_dots(p - start, edge) / np.maximum(_dots(edge, edge), 1e-18), 0.0, 1.0)
    return start + along[:, None] * edge


def _dots(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.einsum("ij,ij->i", a, b)
