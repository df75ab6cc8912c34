"""Plans the way along a route of waypoints round obstacles that are met on the way. Pure: no bus, no clock, no tree.

The planner knows nothing of the world beforehand. Each time a motion is blocked it remembers a disc where the obstacle
was seen, and plans on from where the drone stands: straight on if that keeps clear of every known disc, otherwise by
A* (Hart, Nilsson, Raphael 1968) on a lattice of 1 m, its path pulled tight. A waypoint that cannot be reached is given
up, so that every route comes to an end.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TypeAlias

Point: TypeAlias = tuple[float, float]
Position: TypeAlias = tuple[float, float, float]
Node: TypeAlias = tuple[int, int]
Area: TypeAlias = tuple[float, float, float, float]
"""West, south, east and north border in metres."""

HULL_RADIUS = 0.65
MARGIN = 2.0
OBSTACLE_RADIUS = 0.3
"""Radius assumed of what was seen as one point, in metres."""
SAME_OBSTACLE = 0.75
"""What is seen nearer than this to a known disc's centre is the same obstacle, in metres."""
STOPPING_DISTANCE_LIMIT = 15.0
"""Nobody stops for an obstacle farther ahead than this, in metres; then something unseen is in the way."""
GROWTH = 0.5
"""Added to the radius of a disc that was met again, in metres: it must be larger than assumed."""
CELL = 1.0
LONGEST_EDGE = CELL * math.sqrt(2)
ARRIVED_WITHIN = 0.5
"""A waypoint nearer than this counts as reached, in metres."""
AT_HOME = 2.0
"""A waypoint nearer than this to the origin, on the ground plan, is over home, in metres."""
_BORDER = 4.0
"""How far beyond what has to be kept clear of the lattice reaches, in metres."""


@dataclass(frozen=True, slots=True)
class Disc:
    """A known obstacle on the ground plan (ENU, metres). seen: a sensor has seen it; otherwise it is only assumed."""

    centre: Point
    radius: float = OBSTACLE_RADIUS
    seen: bool = True


@dataclass(frozen=True, slots=True)
class GivenUp:
    """A waypoint, by its index in the route, that was left out, and why. for_obstacle: obstacles that were seen kept
    the drone from it, and nothing else."""

    waypoint: int
    reason: str
    for_obstacle: bool


class KnownSpace:
    """Which straight motions keep clear of the known discs.

    clearance: metres between a disc and the drone's centre. area: where detours may lead; None for anywhere.
    """

    def __init__(self, clearance: float = HULL_RADIUS + MARGIN, area: Area | None = None) -> None:
        self.clearance = clearance
        self.area = area
        self.discs: list[Disc] = []

    def add(self, place: Point, *, seen: bool = True) -> None:
        """Remember an obstacle at `place`; one that is known already grows."""
        for index, disc in enumerate(self.discs):
            if math.dist(disc.centre, place) < SAME_OBSTACLE:
                self.discs[index] = Disc(disc.centre, disc.radius + GROWTH, disc.seen or seen)
                return
        self.discs.append(Disc(place, seen=seen))

    def is_node(self, point: Point) -> bool:
        """Tell whether a detour may lead over `point`, and from there along any lattice edge to another such point."""
        if self.area is not None:
            west, south, east, north = self.area
            if not (west <= point[0] <= east and south <= point[1] <= north):
                return False
        # Of an edge between two points that are this far from a centre, no part is nearer to it than the reach.
        return all(
            math.dist(point, disc.centre) >= math.hypot(self._reach(disc), LONGEST_EDGE / 2) for disc in self.discs
        )

    def is_open(self, a: Point, b: Point) -> bool:
        """Tell whether the segment from `a` to `b` keeps clear.

        Where `a` or `b` itself stands too near to a disc, the motion may come as near as that, but no nearer: a drone
        that was stopped by an obstacle can leave, and a waypoint beside one can be reached.
        """
        for disc in self.discs:
            allowed = min(self._reach(disc), math.dist(a, disc.centre), math.dist(b, disc.centre))
            if _distance_to_segment(disc.centre, a, b) < allowed - 1e-9:
                return False
        return True

    def path(self, start: Point, goal: Point) -> list[Point] | None:
        """Corners of a way from `start` to `goal` (without `start`), or None where there is none."""
        if any(math.dist(goal, disc.centre) < HULL_RADIUS + disc.radius for disc in self.discs):
            return None
        if self.is_open(start, goal):
            return [goal]
        lattice = self._search(start, goal)
        return None if lattice is None else self._pull_tight(start, [*lattice, goal])

    def _reach(self, disc: Disc) -> float:
        return disc.radius + self.clearance

    def _search(self, start: Point, goal: Point) -> list[Point] | None:
        """A* over lattice nodes from where `start` can leave to where `goal` can be entered."""
        usable = _Lattice(self, start, goal)
        frontier: list[tuple[float, Node]] = []
        cost: dict[Node, float] = {}
        parent: dict[Node, Node | None] = {}
        for node in usable.around(start):
            cost[node] = math.dist(start, _place(node))
            parent[node] = None
            heapq.heappush(frontier, (cost[node] + math.dist(_place(node), goal), node))
        exits = set(usable.around(goal))
        closed: set[Node] = set()
        while frontier:
            _, node = heapq.heappop(frontier)
            if node in exits:
                return [_place(step) for step in _back_to_start(parent, node)]
            if node in closed:
                continue
            closed.add(node)
            for neighbour, length in usable.neighbours(node):
                reached = cost[node] + length
                if reached < cost.get(neighbour, math.inf):
                    cost[neighbour] = reached
                    parent[neighbour] = node
                    heapq.heappush(frontier, (reached + math.dist(_place(neighbour), goal), neighbour))
        return None

    def _pull_tight(self, start: Point, corners: list[Point]) -> list[Point]:
        """Leave out every corner that can be passed by."""
        tight: list[Point] = []
        at, rest = start, corners
        while rest:
            far = max(index for index in range(len(rest)) if index == 0 or self.is_open(at, rest[index]))
            at = rest[far]
            tight.append(at)
            rest = rest[far + 1 :]
        return tight


class _Lattice:
    """Nodes 1 m apart within the area that a detour may need."""

    def __init__(self, space: KnownSpace, start: Point, goal: Point) -> None:
        self._space = space
        points = [start, goal, *(disc.centre for disc in space.discs)]
        self._border = max((disc.radius for disc in space.discs), default=0.0) + space.clearance + _BORDER
        self._low = min(x for x, _ in points) - self._border, min(y for _, y in points) - self._border
        self._high = max(x for x, _ in points) + self._border, max(y for _, y in points) + self._border
        self._usable: dict[Node, bool] = {}

    def around(self, point: Point) -> Iterator[Node]:
        """Usable nodes near `point` that it is connected to by an open segment."""
        reach = math.ceil(self._border / CELL)
        column, row = round(point[0] / CELL), round(point[1] / CELL)
        for node in ((column + i, row + j) for i in range(-reach, reach + 1) for j in range(-reach, reach + 1)):
            if self._is_usable(node) and self._space.is_open(point, _place(node)):
                yield node

    def neighbours(self, node: Node) -> Iterator[tuple[Node, float]]:
        for i, j in ((1, 0), (0, 1), (-1, 0), (0, -1), (1, 1), (-1, 1), (-1, -1), (1, -1)):
            neighbour = node[0] + i, node[1] + j
            if self._is_usable(neighbour):
                yield neighbour, CELL * math.hypot(i, j)

    def _is_usable(self, node: Node) -> bool:
        known = self._usable.get(node)
        if known is None:
            x, y = _place(node)
            inside = self._low[0] <= x <= self._high[0] and self._low[1] <= y <= self._high[1]
            known = self._usable[node] = inside and self._space.is_node((x, y))
        return known


class RoutePlanner:
    """Says where to fly next, until every waypoint of the route is reached or given up.

    Ask `next_target`, fly there, tell `arrived` or `blocked`, and ask again. route: waypoints (x, y, z) in ENU metres.
    max_detours: how often the way to one waypoint may be found blocked before it is given up. area: where detours may
    lead, None for anywhere.
    """

    def __init__(self, route: Sequence[Position], *, max_detours: int = 10, area: Area | None = None) -> None:
        self.route = tuple(route)
        self.known = KnownSpace(area=area)
        self.given_up: list[GivenUp] = []
        self._reached: list[int] = []
        self._max_detours = max_detours
        self._detours = 0
        self._stopped_unseen = False
        self._waypoint = 0
        self._legs: list[Position] = []

    @property
    def waypoint(self) -> int:
        """Index of the waypoint being flown to; the length of the route when it is done."""
        return self._waypoint

    @property
    def done(self) -> bool:
        return self._waypoint >= len(self.route)

    @property
    def reached(self) -> int:
        """How many waypoints were reached."""
        return len(self._reached)

    @property
    def fulfilled(self) -> bool:
        """The route is done as well as the place allows: nothing but obstacles kept the drone from any waypoint, and
        it reached one at least that is not over home, if there are such: coming home again is no route."""
        away = {index for index, (x, y, _) in enumerate(self.route) if math.hypot(x, y) > AT_HOME}
        been = self._reached if not away else away.intersection(self._reached)
        return self.done and bool(been) and all(left.for_obstacle for left in self.given_up)

    @property
    def account(self) -> str:
        """What has become of the waypoints, in words."""
        text = f"{self.reached} of {len(self.route)} waypoints reached"
        if not self.given_up:
            return text
        left_out = "; ".join(f"{left.waypoint + 1} given up: {left.reason}" for left in self.given_up)
        return f"{text} ({left_out})"

    @property
    def target(self) -> Position | None:
        """End of the straight leg that was asked for last and is not flown yet."""
        return self._legs[0] if self._legs else None

    def next_target(self, position: Position) -> Position | None:
        """The end of the next straight leg from `position`; None when the route is done.

        The same leg is given again until `arrived`, `blocked` or `carried` is told: another branch can take over.
        """
        while not self._legs and not self.done:
            waypoint = self.route[self._waypoint]
            if math.dist(position, waypoint) <= ARRIVED_WITHIN:
                self._reach()
                continue
            corners = self.known.path(position[:2], waypoint[:2])
            if corners is None:
                seen = all(disc.seen for disc in self.known.discs)
                self._give_up("known obstacles leave no way to it", for_obstacle=seen)
            else:
                self._legs = _at_heights(position, corners, waypoint)
        return self.target

    def arrived(self) -> None:
        """The leg asked for last has been flown to its end."""
        if not self._legs:
            return
        del self._legs[0]
        if not self._legs:
            self._reach()

    def carried(self) -> None:
        """Somebody else may have flown the drone: plan the way to the same waypoint anew, from wherever it is."""
        self._legs = []

    def blocked(self, position: Position, distance: float) -> None:
        """The leg asked for last ended at `position`, with an obstacle `distance` metres ahead on it."""
        if not self._legs:
            return
        target = self._legs[0]
        ahead = math.dist(position[:2], target[:2])
        seen = distance <= STOPPING_DISTANCE_LIMIT
        self._stopped_unseen |= not seen
        if ahead > 1e-6:
            believed = distance if seen else MARGIN
            share = max(believed, OBSTACLE_RADIUS) / ahead
            x = position[0] + share * (target[0] - position[0])
            y = position[1] + share * (target[1] - position[1])
            self.known.add((x, y), seen=seen)
        self._legs = []
        self._detours += 1
        if self._detours > self._max_detours:
            blocked = f"the way was found blocked {self._detours} times"
            unseen = ", by something that no sensor saw" if self._stopped_unseen else ""
            self._give_up(blocked + unseen, for_obstacle=not self._stopped_unseen)

    def _reach(self) -> None:
        self._reached.append(self._waypoint)
        self._next_waypoint()

    def _give_up(self, reason: str, *, for_obstacle: bool) -> None:
        self.given_up.append(GivenUp(self._waypoint, reason, for_obstacle))
        self._next_waypoint()

    def _next_waypoint(self) -> None:
        self._waypoint += 1
        self._detours = 0
        self._stopped_unseen = False


def bearing(start: Position, target: Position) -> float | None:
    """Direction of the leg on the ground plan, radians counter-clockwise from east; None for a vertical leg."""
    east, north = target[0] - start[0], target[1] - start[1]
    return math.atan2(north, east) if math.hypot(east, north) > 1e-3 else None


def crab_heading(direction: float, heading: float) -> float:
    """Heading (-pi..pi) across `direction` that needs the least turning from `heading`.

    With the nose at right angles to the motion, the motion lies in the plane of a ring mounted across the nose.
    """
    sides = (direction - math.pi / 2, direction + math.pi / 2)
    return wrap(min(sides, key=lambda side: abs(wrap(side - heading))))


def wrap(angle: float) -> float:
    """The same angle in -pi..pi."""
    return math.remainder(angle, 2 * math.pi)


def _place(node: Node) -> Point:
    return node[0] * CELL, node[1] * CELL


def _back_to_start(parent: dict[Node, Node | None], node: Node) -> list[Node]:
    steps = [node]
    while (before := parent[steps[-1]]) is not None:
        steps.append(before)
    return steps[::-1]


def _at_heights(start: Position, corners: list[Point], end: Position) -> list[Position]:
    """The corners as positions whose height changes evenly along the way."""
    lengths = [math.dist(a, b) for a, b in zip([start[:2], *corners], corners, strict=False)]
    total = sum(lengths)
    legs: list[Position] = []
    flown = 0.0
    for corner, length in zip(corners, lengths, strict=True):
        flown += length
        share = flown / total if total > 0 else 1.0
        legs.append((corner[0], corner[1], start[2] + share * (end[2] - start[2])))
    legs[-1] = end
    return legs


def _distance_to_segment(point: Point, a: Point, b: Point) -> float:
    along = b[0] - a[0], b[1] - a[1]
    square = along[0] ** 2 + along[1] ** 2
    if square == 0.0:
        return math.dist(point, a)
    share = ((point[0] - a[0]) * along[0] + (point[1] - a[1]) * along[1]) / square
    share = min(1.0, max(0.0, share))
    return math.dist(point, (a[0] + share * along[0], a[1] + share * along[1]))
