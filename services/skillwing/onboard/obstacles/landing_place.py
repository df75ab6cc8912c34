"""Landing place: straight down, or the nearest place known to be free if an obstacle is known below.

No sensor monitors the descent, so the decision rests on memory. Unseen ground is neither free nor taken: without
knowledge of the ground below, the drone lands there, as one without sensors does.
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
Mask = NDArray[np.bool_]

ANYWHERE: Final = Box((-np.inf, -np.inf, -np.inf), (np.inf, np.inf, np.inf))
REACH: Final = 15.0
"""Radius of the search for another place [m]."""
ROOM: Final = TUBE_RADIUS + 0.3
"""Radius around another place that has to be free of obstacles [m]."""
SURROUNDINGS: Final = REACH + ROOM
"""Radius of the surroundings that matter to a landing [m]."""
STEP: Final = 0.4
"""Largest height above the ground of a place to land [m]."""
SLOPE: Final = 0.4
"""Largest slope between connected squares; beyond it, and beyond STEP, they are roofs or the like."""
STEEPEST: Final = 0.25
"""Largest slope of a landing, 14 degrees: the drone stands on a slope of 10 degrees, and topples on one of 20."""
_OBSTACLE = 3
"""Fewest voxels of an obstacle; fewer are noise."""
_PLANE: Final = 12
"""Fewest voxels of ground that give its slope."""
_THIN: Final = 0.1
"""Least ratio of width to length of ground that gives the slope across it."""
_GRID: Final = 0.5
"""Distance between candidate places, and side of the squares by which ground counts as seen [m]."""
_BEARINGS: Final = 72
"""Number of bearings for a first test of reachable places."""
_GAP = 2.0
"""Longest unseen gap in connected ground [m]."""
_HILLSIDE = 0.2
"""Largest slope of ground across a longer unseen gap. From the ground that is seen beside it, a roof rises steeper."""
_PLOT = 20
"""Fewest connected squares of ground; smaller patches are noise if there is one of this size."""
_SEEN: Final = 0.7
"""Least share of the squares around another place that was seen."""
_GLIMPSED: Final = 0.15
"""The same if no such place is known: a line of ground across it, as the range-finder sees it."""


class Below:
    """Known ground around a hovering drone, from a local map of its surroundings."""

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
        """An obstacle, a roof or a slope is below the drone."""
        return not self._is_clear(self._here[:2], TUBE_RADIUS)

    @property
    def seen(self) -> bool:
        """The ground below was seen, on all sides."""
        return self._share_seen(self._here[:2]) >= _SEEN

    def free_place(self, targets: Box = ANYWHERE) -> Vector | None:
        """The nearest place inside `targets` above seen ground, with free ways there and down. It is at the drone's
        height, or as near to that as `targets` allows.

        A place with all of its ground seen comes first; otherwise a part is enough.
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
        """Candidate places (2,), the nearest first, without those behind an obstacle."""
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
        """Free distance at each bearing [m]: one test for all the places there."""
        bearings = np.arange(_BEARINGS) * (2.0 * np.pi / _BEARINGS)
        ends = self._here + REACH * np.column_stack([np.cos(bearings), np.sin(bearings), np.zeros(_BEARINGS)])
        return np.array([free_distance(self._known, [self._here, end], 2.0 * REACH) for end in ends])

    def _around(self, place: Points, radius: float) -> list[int]:
        """Indices of the points within `radius` of a place, at any height."""
        return self._tree.query_ball_point(place, radius)

    def _is_clear(self, place: Points, radius: float) -> bool:
        """Test for ground without obstacles within `radius`, and without too steep a slope."""
        around = self._around(place, radius)
        rising = self._rising[around]
        if np.count_nonzero(rising) >= _OBSTACLE:
            return False
        ground = self._points[around][~rising]
        return _slope(ground) <= STEEPEST

    def _share_seen(self, place: Points) -> float:
        """Share of the squares around a place that was seen."""
        squares = np.unique(self._square[self._around(place, ROOM)])
        return len(squares) / (np.pi * (ROOM / _GRID) ** 2)

    def _is_reached(self, place: Vector) -> bool:
        """Test for a free way there over seen ground."""
        way = np.array(place) - self._here
        length = float(np.linalg.norm(way))
        below = self._here[:2] + np.arange(0.0, 1.0, _GRID / length)[:, None] * way[:2]
        gaps, _ = self._tree.query(below[1:], distance_upper_bound=2.0 * _GRID)
        if not np.isfinite(gaps).all():
            return False
        return free_distance(self._known, [self._here, self._here + way], 2.0 * REACH) >= length + TUBE_RADIUS / 2.0


def _slope(points: Points) -> float:
    """Slope of the plane that fits these points (N, 3) best; 0 if they are too few."""
    if len(points) < _PLANE:
        return 0.0
    east, north, up = (points - points.mean(axis=0)).T
    (per_east, per_north), *_ = np.linalg.lstsq(np.column_stack([east, north]), up, rcond=_THIN)
    return float(np.hypot(per_east, per_north))


def _squares(points: Points) -> tuple[Squares, Squares]:
    """Squares (M, 2) with points (N, 3) in them, counted from the origin, and the square of each point (N,)."""
    places = np.floor(points[:, :2] / _GRID).astype(np.int64)
    _, first, of = np.unique((places[:, 0] << 32) + places[:, 1], return_index=True, return_inverse=True)
    return places[first], of


def _above_ground(points: Points, squares: Squares, of: Squares) -> Points:
    """Heights of points (N, 3), each `of` one of the squares (M, 2), above the ground next to them.

    Ground is the lowest patch that is connected without steps, with what lies on one hillside with it. Roofs are as
    flat, but not connected to it. If little was seen, all patches count: it is safer to take noise for ground than an
    obstacle.
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
    lowest, *higher = sorted(plots, key=lambda plot: float(np.median(heights[patch == plot])))
    ground = patch == lowest
    for plot in higher:
        if _on_one_hillside(ground, patch == plot, squares, heights):
            ground |= patch == plot
    _, next_to = KDTree(squares[ground]).query(squares)
    return points[:, 2] - heights[ground][next_to][of]


def _on_one_hillside(ground: Mask, patch: Mask, squares: Squares, heights: Points) -> bool:
    """Test for a patch that continues the ground beyond an unseen gap, where they are nearest to each other.

    Otherwise a small patch of lower ground far away would make a roof of the ground below the drone.
    """
    away, next_to = KDTree(squares[ground]).query(squares[patch])
    rise = np.abs(heights[patch] - heights[ground][next_to])
    nearest = np.argmin(away)
    return bool(rise[nearest] <= max(STEP, _HILLSIDE * _GRID * away[nearest]))
