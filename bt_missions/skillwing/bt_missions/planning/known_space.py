"""Obstacles that a mission has found, and paths between them. Pure: no bus, no clock, no tree.

The map is empty at the start. An obstacle is a disc where it was seen, and a path keeps clear of all discs. It is
straight if possible, else found by A* (Hart, Nilsson, Raphael 1968) on a lattice and shortened by string pulling.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypeAlias

Point: TypeAlias = tuple[float, float]
Node: TypeAlias = tuple[int, int]
Area: TypeAlias = tuple[float, float, float, float]
"""West, south, east and north border in metres."""

TIP_RADIUS = 0.84
"""Distance from the robot's centre to its outermost point, in metres."""
MARGIN = 2.0
"""Distance to keep between the tips and an obstacle, in metres."""
STOPPED_BEFORE = 2.0
"""Assumed distance from the robot's centre to an obstacle that stopped it, if it was not measured, in metres."""
OBSTACLE_RADIUS = 0.3
"""Assumed radius of an obstacle that was seen as one point, in metres."""
SAME_OBSTACLE = 0.75
"""Largest distance from the centre of a disc at which an obstacle counts as the same, in metres."""
SAME_PLACE = 0.25
"""Largest distance between two stops that count as the same place, in metres."""
GROWTH = 0.5
"""Growth of the radius of a disc that stops the robot again, in metres: it is larger than assumed."""
CELL = 1.0
"""Distance between neighbours of the lattice, in metres."""
NARROW_CELL = 0.5
"""The same for paths through openings that are narrower than the margin."""
_BORDER = 4.0
"""Width of the lattice beyond the clearance of all discs, in metres."""


@dataclass(frozen=True, slots=True)
class Disc:
    """A known obstacle on the ground plan (ENU, metres). seen: a sensor has seen it; otherwise it is only assumed."""

    centre: Point
    radius: float = OBSTACLE_RADIUS
    seen: bool = True


class KnownSpace:
    """Known discs, and the straight motions and paths that keep clear of them.

    clearance: metres between a disc and the robot's centre. area: border of detours; None for no border. cell: metres
    between neighbours of the lattice.
    """

    def __init__(self, clearance: float = TIP_RADIUS + MARGIN, area: Area | None = None, *, cell: float = CELL) -> None:
        self.clearance = clearance
        self.area = area
        self.cell = cell
        self.discs: list[Disc] = []
        self._closed: list[Disc] = []

    def narrowed(self, room: float) -> KnownSpace:
        """The same obstacles, as places that the robot's centre may approach to `room` metres.

        Assumed sizes do not count here, so they close no opening beside an obstacle.
        """
        narrow = KnownSpace(room, self.area, cell=NARROW_CELL)
        narrow.discs = list(self._closed)
        return narrow

    def add(self, place: Point, *, before: Point | None = None, seen: bool = True) -> None:
        """Store an obstacle at `place`; a known one grows.

        before: end of the blocked motion, if the obstacle is beyond it. After a second stop at the same place, the
        robot's centre cannot reach this end either.
        """
        again = any(math.dist(closed.centre, place) < SAME_PLACE for closed in self._closed)
        self._closed.append(Disc(before if again and before is not None else place, 0.0, seen))
        for index, disc in enumerate(self.discs):
            if math.dist(disc.centre, place) < SAME_OBSTACLE:
                self.discs[index] = Disc(disc.centre, disc.radius + GROWTH, disc.seen or seen)
                return
        self.discs.append(Disc(place, seen=seen))

    def is_open(self, a: Point, b: Point) -> bool:
        """True if the segment from `a` to `b` keeps clear of all discs.

        If `a` or `b` is too near to a disc, the motion may come as near as that, but not nearer. So a robot can leave
        an obstacle that stopped it, and reach a waypoint beside one.
        """
        length = math.dist(a, b)
        for disc in self.discs:
            reach, from_a = self.reach(disc), math.dist(a, disc.centre)
            if from_a >= reach + length:
                continue  # no point of the segment is within reach
            allowed = min(reach, from_a, math.dist(b, disc.centre))
            if _distance_to_segment(disc.centre, a, b) < allowed - 1e-9:
                return False
        return True

    def path(self, start: Point, goal: Point) -> list[Point] | None:
        """Corners of a path from `start` to `goal` (without `start`); None if there is no path."""
        if any(math.dist(goal, disc.centre) < TIP_RADIUS + disc.radius for disc in self.discs):
            return None
        if self.is_open(start, goal):
            return [goal]
        lattice = self._search(start, goal)
        return None if lattice is None else self._pull_tight(start, [*lattice, goal])

    def reach(self, disc: Disc) -> float:
        """Distance that the robot's centre keeps from the centre of a disc, in metres."""
        return disc.radius + self.clearance

    def _search(self, start: Point, goal: Point) -> list[Point] | None:
        """A* over lattice nodes, from those that `start` reaches directly to those that reach `goal` directly."""
        usable = _Lattice(self, start, goal)
        frontier: list[tuple[float, Node]] = []
        cost: dict[Node, float] = {}
        parent: dict[Node, Node | None] = {}
        for node in usable.around(start):
            cost[node] = math.dist(start, usable.place(node))
            parent[node] = None
            heapq.heappush(frontier, (cost[node] + math.dist(usable.place(node), goal), node))
        exits = set(usable.around(goal))
        closed: set[Node] = set()
        while frontier:
            _, node = heapq.heappop(frontier)
            if node in exits:
                return [usable.place(step) for step in _back_to_start(parent, node)]
            if node in closed:
                continue
            closed.add(node)
            for neighbour, length in usable.neighbours(node):
                reached = cost[node] + length
                if reached < cost.get(neighbour, math.inf):
                    cost[neighbour] = reached
                    parent[neighbour] = node
                    heapq.heappush(frontier, (reached + math.dist(usable.place(neighbour), goal), neighbour))
        return None

    def _pull_tight(self, start: Point, corners: list[Point]) -> list[Point]:
        """Drop every corner that a straight segment can skip."""
        tight: list[Point] = []
        at, rest = start, corners
        while rest:
            far = max(index for index in range(len(rest)) if index == 0 or self.is_open(at, rest[index]))
            at = rest[far]
            tight.append(at)
            rest = rest[far + 1 :]
        return tight


class _Lattice:
    """Lattice nodes that a detour may use."""

    def __init__(self, space: KnownSpace, start: Point, goal: Point) -> None:
        self._space = space
        self._cell = space.cell
        points = [start, goal, *(disc.centre for disc in space.discs)]
        self._border = max((disc.radius for disc in space.discs), default=0.0) + space.clearance + _BORDER
        low = min(x for x, _ in points) - self._border, min(y for _, y in points) - self._border
        high = max(x for x, _ in points) + self._border, max(y for _, y in points) + self._border
        self._borders = [(*low, *high), *([] if space.area is None else [space.area])]
        # No part of an edge between two points at this distance from a centre is nearer to it than the reach.
        half = space.cell * math.sqrt(2) / 2
        self._distances = [(disc.centre, math.hypot(space.reach(disc), half)) for disc in space.discs]
        self._usable: dict[Node, bool] = {}

    def around(self, point: Point) -> Iterator[Node]:
        """Usable nodes near `point` with an open segment to it."""
        reach = math.ceil(self._border / self._cell)
        column, row = round(point[0] / self._cell), round(point[1] / self._cell)
        for node in ((column + i, row + j) for i in range(-reach, reach + 1) for j in range(-reach, reach + 1)):
            if self._is_usable(node) and self._space.is_open(point, self.place(node)):
                yield node

    def neighbours(self, node: Node) -> Iterator[tuple[Node, float]]:
        for i, j in ((1, 0), (0, 1), (-1, 0), (0, -1), (1, 1), (-1, 1), (-1, -1), (1, -1)):
            neighbour = node[0] + i, node[1] + j
            if self._is_usable(neighbour):
                yield neighbour, self._cell * math.hypot(i, j)

    def place(self, node: Node) -> Point:
        return node[0] * self._cell, node[1] * self._cell

    def _is_usable(self, node: Node) -> bool:
        known = self._usable.get(node)
        if known is None:
            known = self._usable[node] = self._is_clear(self.place(node))
        return known

    def _is_clear(self, point: Point) -> bool:
        """True if a detour may lead over `point`, and from there along any lattice edge to another such point."""
        for west, south, east, north in self._borders:
            if not (west <= point[0] <= east and south <= point[1] <= north):
                return False
        return all(math.dist(point, centre) >= distance for centre, distance in self._distances)


def _back_to_start(parent: dict[Node, Node | None], node: Node) -> list[Node]:
    steps = [node]
    while (before := parent[steps[-1]]) is not None:
        steps.append(before)
    return steps[::-1]


def _distance_to_segment(point: Point, a: Point, b: Point) -> float:
    along = b[0] - a[0], b[1] - a[1]
    square = along[0] ** 2 + along[1] ** 2
    if square == 0.0:
        return math.dist(point, a)
    share = ((point[0] - a[0]) * along[0] + (point[1] - a[1]) * along[1]) / square
    share = min(1.0, max(0.0, share))
    return math.dist(point, (a[0] + share * along[0], a[1] + share * along[1]))
