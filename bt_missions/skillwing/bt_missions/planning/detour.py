"""Planner for a route of waypoints, with detours round obstacles found on the way. Pure: no bus, no clock, no tree.

After each blocked motion the planner stores where the obstacle was seen, and plans from the position of the robot.
A path keeps a wide margin if it can. Otherwise it leads through narrower openings. A waypoint that cannot be reached is
given up, so every route comes to an end.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

from skillwing.bt_missions.planning.known_space import OBSTACLE_RADIUS, STOPPED_BEFORE, Area, KnownSpace, Point

Position: TypeAlias = tuple[float, float, float]

STOPPING_DISTANCE_LIMIT = 15.0
"""Longest distance to a seen obstacle at which a skill stops, in metres. A farther one is not the reason of a stop."""
ARRIVED_WITHIN = 0.5
"""A waypoint nearer than this counts as reached, in metres."""
NARROWER = (1.4, 0.7, 0.5)
"""Distances between the robot's centre and places where it was stopped, tried in this order, in metres.

They apply when the margin leaves no path. The obstacle is within 1.44 m of such a place, ahead or aside. An opening of
4 m leaves 1.12 m for the centre: the smallest distance keeps it open, and the larger ones prefer wide openings.
"""
AT_HOME = 2.0
"""A waypoint nearer than this to the origin, on the ground plan, counts as home, in metres."""


@dataclass(frozen=True, slots=True)
class GivenUp:
    """A waypoint that was given up, by its index in the route, with the reason. for_obstacle: the only reason is
    obstacles that a sensor saw."""

    waypoint: int
    reason: str
    for_obstacle: bool


class RoutePlanner:
    """Plans the legs to the waypoints of a route, until each is reached or given up.

    Call `next_target`, go there, report with `arrived` or `blocked`, and repeat. route: waypoints (x, y, z) in ENU
    metres. max_detours: blocked legs to one waypoint before narrower openings are tried. max_narrow: blocked legs after
    that before the waypoint is given up. area: border of detours; None for no border.
    """

    def __init__(
        self,
        route: Sequence[Position],
        *,
        max_detours: int = 10,
        max_narrow: int = 30,
        area: Area | None = None,
    ) -> None:
        self.route = tuple(route)
        self.known = KnownSpace(area=area)
        self.given_up: list[GivenUp] = []
        self._reached: list[int] = []
        self._max_detours = max_detours
        self._max_narrow = max_narrow
        self._detours = 0
        self._narrowed = 0
        self._stopped_unseen = False
        self._waypoint = 0
        self._legs: list[Position] = []
        self._asked_at: Position | None = None

    @property
    def waypoint(self) -> int:
        """Index of the current waypoint; the length of the route when it is done."""
        return self._waypoint

    @property
    def done(self) -> bool:
        return self._waypoint >= len(self.route)

    @property
    def reached(self) -> int:
        """Number of waypoints that were reached."""
        return len(self._reached)

    @property
    def fulfilled(self) -> bool:
        """True if the route is done as well as obstacles allow: they are the only reason for waypoints given up.

        At least one waypoint away from home has to be reached, if the route has any: a way home alone is not enough.
        """
        away = {index for index, (x, y, _) in enumerate(self.route) if math.hypot(x, y) > AT_HOME}
        been = self._reached if not away else away.intersection(self._reached)
        return self.done and bool(been) and all(left.for_obstacle for left in self.given_up)

    @property
    def summary(self) -> str:
        """Waypoints reached and given up, as a text."""
        text = f"{self.reached} of {len(self.route)} waypoints reached"
        if not self.given_up:
            return text
        left_out = "; ".join(f"{left.waypoint + 1} given up: {left.reason}" for left in self.given_up)
        return f"{text} ({left_out})"

    @property
    def target(self) -> Position | None:
        """End of the current straight leg; None after its end."""
        return self._legs[0] if self._legs else None

    def next_target(self, position: Position) -> Position | None:
        """The end of the next straight leg from `position`; None when the route is done.

        The leg stays the same until a call of `arrived`, `blocked` or `moved`, so that another branch can take over.
        """
        while not self._legs and not self.done:
            waypoint = self.route[self._waypoint]
            if math.dist(position, waypoint) <= ARRIVED_WITHIN:
                self._reach()
                continue
            corners = self._way(position[:2], waypoint[:2])
            if corners is None:
                seen = all(disc.seen for disc in self.known.discs)
                self._give_up("known obstacles leave no way to it", for_obstacle=seen)
            else:
                self._legs = _at_heights(position, corners, waypoint)
        self._asked_at = position
        return self.target

    def arrived(self) -> None:
        """Report that the current leg was done to its end."""
        if not self._legs:
            return
        del self._legs[0]
        if not self._legs:
            self._reach()

    def moved(self) -> None:
        """Report that someone else may have moved the robot: the next leg to the same waypoint starts where it is."""
        self._legs = []

    def blocked(self, position: Position, distance: float) -> None:
        """Report that the current leg ended at `position`, with an obstacle `distance` metres ahead."""
        if not self._legs:
            return
        seen = distance <= STOPPING_DISTANCE_LIMIT
        self._stopped_unseen |= not seen
        direction = self._direction(position)
        if direction is not None:
            ahead = max(distance if seen else STOPPED_BEFORE, OBSTACLE_RADIUS)
            x = position[0] + ahead * math.cos(direction)
            y = position[1] + ahead * math.sin(direction)
            end = self._legs[0][:2]
            behind_the_end = ahead > math.dist(position[:2], end)
            self.known.add((x, y), before=end if behind_the_end else None, seen=seen)
        self._legs = []
        self._detours += 1
        # An unseen obstacle has no openings to search for.
        most = self._max_detours + (0 if self._stopped_unseen else self._max_narrow)
        if self._detours > most:
            blocked = f"the way was found blocked {self._detours} times"
            unseen = ", by something that no sensor saw" if self._stopped_unseen else ""
            self._give_up(blocked + unseen, for_obstacle=not self._stopped_unseen)

    def _way(self, start: Point, goal: Point) -> list[Point] | None:
        """Corners of a path with the margin; after too many blocked legs, or without such a path, with less room.

        Room that was not enough once is not tried again for the same waypoint.
        """
        if self._detours > self._max_detours:
            self._narrowed = max(self._narrowed, 1)
        while True:
            space = self.known.narrowed(NARROWER[self._narrowed - 1]) if self._narrowed else self.known
            way = space.path(start, goal)
            if way is not None or self._stopped_unseen or self._narrowed == len(NARROWER):
                return way
            self._narrowed += 1

    def _direction(self, position: Position) -> float | None:
        """Direction of the leg that was blocked at `position`; None for a vertical one.

        Near its end the direction from its start counts, as the rest is too short.
        """
        target = self._legs[0]
        at_the_end = math.dist(position[:2], target[:2]) <= ARRIVED_WITHIN
        return bearing(self._asked_at if at_the_end and self._asked_at is not None else position, target)

    def _reach(self) -> None:
        self._reached.append(self._waypoint)
        self._next_waypoint()

    def _give_up(self, reason: str, *, for_obstacle: bool) -> None:
        self.given_up.append(GivenUp(self._waypoint, reason, for_obstacle))
        self._next_waypoint()

    def _next_waypoint(self) -> None:
        self._waypoint += 1
        self._detours = 0
        self._narrowed = 0
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


def _at_heights(start: Position, corners: list[Point], end: Position) -> list[Position]:
    """The corners as positions, with a height that changes evenly along the path."""
    lengths = [math.dist(a, b) for a, b in zip([start[:2], *corners], corners, strict=False)]
    total = sum(lengths)
    legs: list[Position] = []
    done = 0.0
    for corner, length in zip(corners, lengths, strict=True):
        done += length
        share = done / total if total > 0 else 1.0
        legs.append((corner[0], corner[1], start[2] + share * (end[2] - start[2])))
    legs[-1] = end
    return legs
