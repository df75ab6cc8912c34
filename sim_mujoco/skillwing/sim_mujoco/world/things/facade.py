"""A box-shaped building whose facades have recessed windows, as a triangle mesh."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

_RECESS = 0.25


@dataclass(frozen=True, slots=True)
class Windows:
    """Pattern of the openings of a facade [m]: one in each bay along the wall, from `window[0]` to `window[1]`, and in
    each storey from `opening[0]` to `opening[1]` above its floor."""

    bay: float = 2.0
    window: tuple[float, float] = (0.6, 1.6)
    storey: float = 2.8
    opening: tuple[float, float] = (0.9, 2.2)


DWELLING = Windows()


def building_mesh(
    size: tuple[float, float, float], windows: Windows = DWELLING, *, blind_ends: bool = False
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Vertices (N, 3) and faces (M, 3) of a building of this size [m], standing on z = 0, centred in x and y.

    Windows are recessed by 25 cm with closed reveals, so that rays hit their edges.
    `blind_ends` leaves them out on the two walls across x.
    """
    length, width, height = size
    x, y, z = np.eye(3)
    corner = np.array([length / 2, width / 2, 0.0])
    quads: list[NDArray[np.float64]] = []
    for origin, along, extent, is_end in (
        (-corner, x, length, False),
        (corner * (1, -1, 0), y, width, True),
        (corner, -x, length, False),
        (corner * (-1, 1, 0), -y, width, True),
    ):
        if is_end and blind_ends:
            quads.append(_rim(origin, along, z, (0.0, extent), (0.0, height)))
        else:
            quads += _facade(origin, along, z, extent, height, windows)
    roof = np.array([-corner, corner * (1, -1, 0), corner, corner * (-1, 1, 0)]) + height * z
    quads.append(roof)
    vertices = np.concatenate(quads)
    first = 4 * np.arange(len(quads))[:, None]
    faces = np.concatenate([first + np.array(corners) for corners in ((0, 1, 2), (0, 2, 3))])
    return vertices, faces.astype(np.int32)


def _facade(
    origin: NDArray[np.float64],
    along: NDArray[np.float64],
    up: NDArray[np.float64],
    extent: float,
    height: float,
    windows: Windows,
) -> list[NDArray[np.float64]]:
    inwards = np.cross(up, along)
    columns, is_window_column = _cuts(extent, windows.bay, windows.window)
    rows, is_window_row = _cuts(height, windows.storey, windows.opening)
    quads: list[NDArray[np.float64]] = []
    for across, glazed_column in zip(pairwise(columns), is_window_column, strict=True):
        for upright, glazed_row in zip(pairwise(rows), is_window_row, strict=True):
            rim = _rim(origin, along, up, across, upright)
            if not (glazed_column and glazed_row):
                quads.append(rim)
                continue
            pane = rim + _RECESS * inwards
            quads.append(pane)
            for i, j in ((0, 1), (1, 2), (2, 3), (3, 0)):
                quads.append(np.array([rim[i], rim[j], pane[j], pane[i]]))
    return quads


def _rim(
    origin: NDArray[np.float64],
    along: NDArray[np.float64],
    up: NDArray[np.float64],
    across: tuple[float, float],
    upright: tuple[float, float],
) -> NDArray[np.float64]:
    (left, right), (low, high) = across, upright
    return np.array([origin + along * a + up * b for a, b in ((left, low), (right, low), (right, high), (left, high))])


def _cuts(extent: float, period: float, opening: tuple[float, float]) -> tuple[list[float], list[bool]]:
    """Cut an extent into alternating wall and opening; openings that would not fit whole are left out."""
    edges, glazed, start = [0.0], list[bool](), 0.0
    while start + opening[1] < extent - 0.3:
        edges += [start + opening[0], start + opening[1]]
        glazed += [False, True]
        start += period
    return [*edges, extent], [*glazed, False]
