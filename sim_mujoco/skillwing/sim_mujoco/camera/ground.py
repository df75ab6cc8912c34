"""Paint on the ground: faces of the terrain with the few strips of paving near them."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from skillwing.sim_mujoco.camera.shading import Paint
from skillwing.sim_mujoco.world.layouts.ground import Strip
from skillwing.sim_mujoco.world.rendering import WIDEST_ROAD, painted, patches

Array = NDArray[np.float32]
Mask = NDArray[np.bool_]


class GroundPaint:
    """Colours of places on the ground, as `painted` gives them, but only from the strips near each place.

    Faces within one strip have its colour.
    """

    def __init__(self, corners: Array, is_ground: Mask, colours: Array, paving: Sequence[Strip]) -> None:
        """Corners (3, F, 3) of all faces, of which these (F,) are ground, and colours (F, 3) where nothing is paved."""
        self.colours = colours.copy()
        """Colours (F, 3) of the faces before they are painted."""
        near, within = _strips_of(corners[:, is_ground, :2], paving)
        of_one = np.flatnonzero((within >= 0) & (near.sum(axis=1) == 1))
        ground = np.flatnonzero(is_ground)
        if len(of_one):
            self.colours[ground[of_one]] = np.array([strip.colour for strip in paving])[within[of_one]]
        sets, set_of = np.unique(near, axis=0, return_inverse=True)
        set_of[of_one] = len(sets)
        # Faces without paint, as the sky, have the number after the last set.
        all_sets = np.full(len(is_ground) + 1, len(sets), dtype=np.int32)
        all_sets[ground] = set_of
        rows = np.array([_row(strip) for strip in paving], dtype=np.float32).reshape(-1, 7)
        strips = np.array([strip.colour for strip in paving], dtype=np.float32).reshape(-1, 3)
        first = np.concatenate([[0], np.cumsum(sets.sum(axis=1))]).astype(np.int32)
        self.paint = Paint(all_sets, first, np.nonzero(sets)[1].astype(np.int32), rows, strips)

    def patches(self, faces: NDArray[np.int32], x: Array, y: Array) -> Array:
        """Factors (N,) of the grass at places x, y (N,) on these faces (N,), -1 for the sky; 1 without grass."""
        factors = np.ones(len(x), dtype=np.float32)
        grass = np.flatnonzero(self.paint.set_of.take(faces) < len(self.paint.first) - 1)
        factors[grass] = patches(x.take(grass), y.take(grass))
        return factors


def _row(strip: Strip) -> tuple[float, ...]:
    (ax, ay), (bx, by) = strip.start, strip.end
    length = math.hypot(bx - ax, by - ay)
    return ax, ay, (bx - ax) / length, (by - ay) / length, length, strip.width / 2, float(strip.width <= WIDEST_ROAD)


def _strips_of(corners: Array, paving: Sequence[Strip]) -> tuple[Mask, NDArray[np.intp]]:
    """Mask (F, S) of the strips that may show on faces, and the strip (F,) that covers each face, -1 for none.

    corners: of the faces (3, F, 2). A covering strip hides those below it.
    """
    middle = corners.mean(axis=0)
    radius = np.linalg.norm(corners - middle, axis=2).max(axis=0)
    near = np.zeros((len(middle), len(paving)), dtype=np.bool_)
    within = np.full(len(middle), -1)
    for k, strip in enumerate(paving):
        near[:, k] = _distances(middle, strip) <= radius + strip.width / 2
        # Strips are convex: a face with all corners in a strip lies in it.
        whole = near[:, k] & np.all([_covered(each, strip) for each in corners], axis=0)
        near[whole, :k] = False
        within[whole] = k
    return near, within


def _covered(places: Array, strip: Strip) -> Mask:
    """Mask of places (N, 2) that the strip paints."""
    unpainted = np.full((len(places), 3), np.nan, dtype=np.float32)
    return ~np.isnan(painted(places, unpainted, [strip])[:, 0])


def _distances(places: Array, strip: Strip) -> NDArray[np.float64]:
    """Distances (N,) of places (N, 2) from the line in the middle of a strip [m]."""
    start, length = np.array(strip.start), math.dist(strip.start, strip.end)
    along = np.subtract(strip.end, start) / length
    ahead = np.clip((places - start) @ along, 0.0, length)
    return np.linalg.norm(places - start - ahead[:, None] * along, axis=1)
