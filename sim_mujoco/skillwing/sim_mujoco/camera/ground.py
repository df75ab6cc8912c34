"""Paint on the ground: faces of the terrain with the few strips of paving near them."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from skillwing.sim_mujoco.world.layouts.ground import Strip
from skillwing.sim_mujoco.world.rendering import painted

Array = NDArray[np.float32]
Mask = NDArray[np.bool_]


class GroundPaint:
    """Colours of places on the ground, as `painted` gives them, but only from the strips near each place.

    Faces with the same strips are painted together. Faces within one strip have its colour.
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
        self._sets = [[strip for strip, shows in zip(paving, each, strict=True) if shows] for each in sets]
        set_of[of_one] = len(sets)
        self._set_of = np.full(len(is_ground) + 1, len(sets), dtype=np.intp)
        """The number of each face's set of strips. Faces without paint, as the sky, have the number after the last."""
        self._set_of[ground] = set_of

    def paint(self, colours: Array, faces: NDArray[np.intp], x: Array, y: Array) -> None:
        """Paint the ground among colours (3, N) of places x, y (N,) on these faces (N,), -1 for the sky."""
        sets = self._set_of.take(faces)
        occurs = np.zeros(len(self._sets) + 1, dtype=np.bool_)
        occurs[sets] = True
        for number in np.flatnonzero(occurs[:-1]):
            here = np.flatnonzero(sets == number)
            places = np.stack([x.take(here), y.take(here)])
            found = painted(places.T, colours.take(here, axis=1).T, self._sets[number])
            for row, values in zip(colours, found.T, strict=True):
                row[here] = values


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
