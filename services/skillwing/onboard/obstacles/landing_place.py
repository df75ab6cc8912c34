"""Where to land: here, unless something is known to stand below; then at the nearest place that is known to be free.

Nothing watches while the drone sinks, so it is memory that counts. What nobody has seen is neither free nor taken: a
drone that knows nothing of the ground below it lands there, as one without sensors does.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from skillwing.onboard.frames.extent import Box
from skillwing.onboard.frames.vectors import Vector, clamp
from skillwing.onboard.obstacles.free_space import TUBE_RADIUS, free_distance
from skillwing.onboard.obstacles.local_map import LocalMap

Points = NDArray[np.float64]
Squares = NDArray[np.int64]

ANYWHERE: Final = Box((-np.inf, -np.inf, -np.inf), (np.inf, np.inf, np.inf))
REACH: Final = 15.0
"""How far away another place is looked for [m]."""
ROOM: Final = TUBE_RADIUS + 0.3
"""Radius around another place in which nothing may stand, for it is not where the drone hovers yet [m]."""
SURROUNDINGS: Final = REACH + ROOM
"""How far around a drone that wants to land anything matters [m]."""
STEP: Final = 0.4
"""What rises higher above the ground than this is no ground to land on [m]."""
SLOPE: Final = 0.4
"""What is reached from the ground only by steeper ways than this, and by higher steps, is a roof or the like."""
STEEPEST: Final = 0.25
"""On a slope of 10 degrees the drone lands and stands, on one of 20 it topples: no landing above this, 14 degrees."""
_OBSTACLE = 3
"""So many voxels are an obstacle, fewer are noise."""
_PLANE: Final = 12
"""So many voxels of ground tell its slope, fewer do not."""
_THIN: Final = 0.1
"""Across a line of ground that is thinner than this share of its length its slope is not known."""
_GRID: Final = 0.5
"""Between the places that are tried, and the side of the squares by which ground counts as seen [m]."""
_BEARINGS: Final = 72
"""In which it is looked how far places can be reached at all."""
_GAP = 2.0
"""Over what was not seen in between, ground goes on as far as this [m]."""
_PLOT = 20
"""So many squares that lie together may be ground, fewer are noise where there are so many."""
_SEEN: Final = 0.7
"""Of the squares around another place so many have to be seen at least."""
_GLIMPSED: Final = 0.15
"""The same where no such place is known: a line of the ground across it, as the range-finder sees it."""


class Below:
    """What is known of the ground around a hovering drone, from a local map of its surroundings."""

    def __init__(self, known: LocalMap, here: Vector) -> None:
        """`here` is the drone's position (ENU) [m]."""
        self._here = np.array(here)
        span = np.array([SURROUNDINGS, SURROUNDINGS, np.inf])
        low, high = self._here - span, self._here + span
        self._known = known.part(low, high)
        high[2] = self._here[2] + TUBE_RADIUS
        points = self._known.solid_within(low, high)
        self._points = points
        squares, self._square = _squares(points)
        self._rising = _above_ground(points, squares, self._square) > STEP
        self._tree = KDTree(points[:, :2])

    @property
    def taken(self) -> bool:
        """Whether something stands where the drone would come down, or a roof is there, or a slope."""
        return not self._is_clear(self._here[:2], TUBE_RADIUS)

    @property
    def seen(self) -> bool:
        """Whether the ground there was seen, on all sides."""
        return self._share_seen(self._here[:2]) >= _SEEN

    def free_place(self, targets: Box = ANYWHERE) -> Vector | None:
        """The nearest place among those that may be `targets`, below which ground was seen, with free ways there and
        down. It is at the drone's height, or as near to that as targets may be.

        Better one where all of the ground was seen; but one where a part of it was is better than none.
        """
        height = clamp(float(self._here[2]), targets.low[2], targets.high[2])
        glimpsed: Vector | None = None
        for place in self._tries():
            found = float(place[0]), float(place[1]), height
            if not targets.contains(found):
                continue
            seen = self._share_seen(place)
            if seen < (_SEEN if glimpsed else _GLIMPSED) or not self._is_clear(place, ROOM):
                continue
            if self._is_reached(found):
                if seen >= _SEEN:
                    return found
                glimpsed = found
        return glimpsed

    def _tries(self) -> Iterator[Points]:
        """Places (2,), the nearest first, but for those that are behind something."""
        steps = np.arange(-REACH, REACH + _GRID, _GRID)
        east, north = np.meshgrid(steps, steps)
        offsets = np.column_stack([east.ravel(), north.ravel()])
        away = np.linalg.norm(offsets, axis=1)
        bearing = np.arctan2(offsets[:, 1], offsets[:, 0]) / (2.0 * np.pi) * _BEARINGS
        behind = away > self._open()[np.round(bearing).astype(np.int64) % _BEARINGS]
        near = np.flatnonzero((away > 0.0) & (away <= REACH) & ~behind)
        for at in near[np.argsort(away[near], kind="stable")]:
            yield self._here[:2] + offsets[at]

    def _open(self) -> Points:
        """How far it is free to each of so many bearings [m]: one look at each for all the places that lie there."""
        bearings = np.arange(_BEARINGS) * (2.0 * np.pi / _BEARINGS)
        ends = self._here + REACH * np.column_stack([np.cos(bearings), np.sin(bearings), np.zeros(_BEARINGS)])
        return np.array([free_distance(self._known, [self._here, end], 2.0 * REACH) for end in ends])

    def _around(self, place: Points, radius: float) -> list[int]:
        """Which points lie within so much of a place, however high."""
        return self._tree.query_ball_point(place, radius)

    def _is_clear(self, place: Points, radius: float) -> bool:
        """Whether nothing rises from the ground so near, and a plane through that is no slope to slip down."""
        around = self._around(place, radius)
        rising = self._rising[around]
        if np.count_nonzero(rising) >= _OBSTACLE:
            return False
        ground = self._points[around][~rising]
        return _slope(ground) <= STEEPEST

    def _share_seen(self, place: Points) -> float:
        """Of the squares around a place."""
        squares = np.unique(self._square[self._around(place, ROOM)])
        return len(squares) / (np.pi * (ROOM / _GRID) ** 2)

    def _is_reached(self, place: Vector) -> bool:
        """Whether the way there leads over seen places, and nothing stands in it."""
        way = np.array(place) - self._here
        length = float(np.linalg.norm(way))
        below = self._here[:2] + np.arange(0.0, 1.0, _GRID / length)[:, None] * way[:2]
        gaps, _ = self._tree.query(below[1:], distance_upper_bound=2.0 * _GRID)
        if not np.isfinite(gaps).all():
            return False
        return free_distance(self._known, [self._here, self._here + way], 2.0 * REACH) >= length + TUBE_RADIUS / 2.0


def _slope(points: Points) -> float:
    """Of the plane that fits these points (N, 3) best, as far as they tell."""
    if len(points) < _PLANE:
        return 0.0
    east, north, up = (points - points.mean(axis=0)).T
    (per_east, per_north), *_ = np.linalg.lstsq(np.column_stack([east, north]), up, rcond=_THIN)
    return float(np.hypot(per_east, per_north))


def _squares(points: Points) -> tuple[Squares, Squares]:
    """Squares (M, 2) with points (N, 3) in them, counted from the origin, and which of them each point is in (N,)."""
    places = np.floor(points[:, :2] / _GRID).astype(np.int64)
    _, first, of = np.unique((places[:, 0] << 32) + places[:, 1], return_index=True, return_inverse=True)
    return places[first], of


def _above_ground(points: Points, squares: Squares, of: Squares) -> Points:
    """How high points (N, 3), each `of` one of the squares (M, 2), lie above the ground next to them.

    Ground is the lowest of what hangs together without steps. Roofs are as flat, but nothing leads up to them. Where
    little was seen, all of it counts: rather is noise taken for ground than what stands on it.
    """
    if len(points) == 0:
        return np.empty(0)
    heights = np.full(len(squares), np.inf)
    np.minimum.at(heights, of, points[:, 2])
    one, other = KDTree(squares * _GRID).query_pairs(_GAP, output_type="ndarray").T
    apart = _GRID * np.linalg.norm(squares[one] - squares[other], axis=1)
    joined = np.abs(heights[one] - heights[other]) <= np.maximum(STEP, SLOPE * apart)
    links = coo_array((joined[joined], (one[joined], other[joined])), shape=(len(squares), len(squares)))
    _, patch = connected_components(links, directed=False)
    sizes = np.bincount(patch)
    plots = np.flatnonzero(sizes >= (_PLOT if sizes.max() >= _PLOT else 1))
    lowest = min(plots, key=lambda plot: float(np.median(heights[patch == plot])))
    ground = patch == lowest
    _, next_to = KDTree(squares[ground]).query(squares)
    return points[:, 2] - heights[ground][next_to][of]
