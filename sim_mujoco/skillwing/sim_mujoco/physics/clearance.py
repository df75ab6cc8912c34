"""Distance from a point to the nearest surface, for the ground truth."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from skillwing.onboard.frames.vectors import Vector
from skillwing.sim_mujoco.world.triangles import Triangles

Points = NDArray[np.float64]

_CELL = 4.0
_STRIDE = 1.0
"""Distance from a point within which the same candidate triangles are searched [m]."""


class Clearance:
    """Exact distances from points to the triangles that do not carry the label `ignore`; at most `reach` [m].

    Triangles are grouped by cubes of 4 m, so that only near groups are searched. Successive points along a path are
    fast: the candidates around one point are kept for the following points.
    """

    def __init__(self, triangles: Triangles, ignore: int, reach: float = 15.0) -> None:
        keep = np.flatnonzero(triangles.labels != ignore)
        a, b, c = triangles.corners()
        cells = np.floor((a[keep] + b[keep] + c[keep]) / (3.0 * _CELL)).astype(np.int64)
        _, group = np.unique(cells, axis=0, return_inverse=True)
        keep = keep[np.argsort(group, kind="stable")]
        a, b, c = (corner[keep].astype(np.float64) for corner in (a, b, c))
        self._all = a, b - a, c - a
        self._counts = np.bincount(group)
        starts = np.cumsum(self._counts) - self._counts
        self._low = np.minimum.reduceat(np.minimum(np.minimum(a, b), c), starts) if len(keep) else a
        self._high = np.maximum.reduceat(np.maximum(np.maximum(a, b), c), starts) if len(keep) else a
        self._reach = reach
        self._middle = np.full(3, np.inf)
        self._near, self._distances = self._all, np.zeros(0)

    def distance(self, point: Vector) -> float:
        """Distance [m] from `point` to the nearest surface, or the reach where none is nearer."""
        p = np.array(point)
        away = float(np.linalg.norm(p - self._middle))
        if away > _STRIDE:
            away, self._middle = 0.0, p
            self._near, self._distances = self._candidates(p)
        nearest = self._distances[0] if len(self._distances) else self._reach
        # The nearest triangle is at most that much farther now, and any other at most that much nearer.
        count = np.searchsorted(self._distances, nearest + 2.0 * away, side="right")
        a, ab, ac = (each[:count] for each in self._near)
        return float(np.sqrt(_square_distances(p, a, ab, ac).min(initial=self._reach**2)))

    def _candidates(self, p: Points) -> tuple[tuple[Points, Points, Points], Points]:
        """Triangles that may be the nearest to any point within a stride of `p`, and their distances from `p`, the
        nearest first."""
        outside = np.maximum(np.maximum(self._low - p, p - self._high), 0.0)
        farthest = np.maximum(np.abs(p - self._low), np.abs(self._high - p))
        # A group lies nearer than the farthest corner of its box, so no group beyond that needs a search.
        certain = float(np.sqrt(_dots(farthest, farthest).min(initial=np.inf)))
        within = min(self._reach, certain) + 2.0 * _STRIDE
        near = np.flatnonzero(np.repeat(_dots(outside, outside) <= within**2, self._counts))
        a, ab, ac = (each[near] for each in self._all)
        distances = np.sqrt(_square_distances(p, a, ab, ac))
        kept = np.flatnonzero(distances <= distances.min(initial=self._reach) + 2.0 * _STRIDE)
        kept = kept[np.argsort(distances[kept])]
        return (a[kept], ab[kept], ac[kept]), distances[kept]


def _square_distances(p: Points, a: Points, ab: Points, ac: Points) -> Points:
    """Squared distances (N,) from `p` to each triangle (a, a + ab, a + ac)."""
    away = p - _closest_points(p, a, ab, ac)
    return _dots(away, away)


def _closest_points(p: Points, a: Points, ab: Points, ac: Points) -> Points:
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


def _on_edge(p: Points, start: Points, edge: Points) -> Points:
    along = np.clip(_dots(p - start, edge) / np.maximum(_dots(edge, edge), 1e-18), 0.0, 1.0)
    return start + along[:, None] * edge


def _dots(a: Points, b: Points) -> Points:
    return np.einsum("ij,ij->i", a, b)
