"""Route of a mission: one leaf writes its legs, others follow them, and all branches share it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, cast

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from skillwing.bt_missions.leaves.context import MissionContext
from skillwing.bt_missions.planning.detour import Position, RoutePlanner, bearing, crab_heading
from skillwing.bt_missions.planning.known_space import STOPPED_BEFORE
from skillwing.services.protocol import Ending, Terminal

POSITION_PATIENCE = 5.0
"""Longest wait of a writer for a fresh position, in seconds of robot time."""


@dataclass(frozen=True, slots=True)
class Leg:
    """One straight motion. crab: heading (rad, ENU) at which the motion lies in the plane of the LiDAR's ring."""

    target: Position
    crab: float


class Route:
    """A route and its current leg. Waypoints that are done stay done when another branch takes over."""

    def __init__(self, context: MissionContext, planner: RoutePlanner) -> None:
        self.planner = planner
        self.leg: Leg | None = None
        self._context = context

    def is_done(self) -> bool:
        return self.planner.done

    def target(self) -> dict[str, float]:
        """End of the current leg, as an input of a motion skill."""
        leg = self._written()
        return dict(zip("xyz", leg.target, strict=True))

    def crab(self) -> float:
        """Crab heading of the current leg."""
        return self._written().crab

    def write(self) -> bool:
        """Plan the next `leg` from the position of the robot; None when the route is done.

        Returns False, and keeps the current leg, if the position or heading is unknown.
        """
        position, heading = fresh_position(self._context), self._number("heading")
        if position is None or heading is None:
            return False
        target = self.planner.next_target(position)
        self.leg = None if target is None else _leg(position, heading, target)
        return True

    def leg_ended(self, terminal: Terminal) -> None:
        """Report the end of a motion skill to the planner: arrived, blocked by an obstacle, or held."""
        if terminal.result == "BLOCKED":
            output = terminal.output or {}
            stopped = _position(output.get("stopped_at")) or fresh_position(self._context)
            if stopped is not None:
                self.planner.blocked(stopped, float(output.get("obstacle_distance", STOPPED_BEFORE)))
        elif terminal.ending is Ending.SUCCEEDED and terminal.success:
            self.planner.arrived()
        elif terminal.ending in (Ending.INTERRUPTED, Ending.INVARIANT_VIOLATED):
            self.planner.moved()

    def _written(self) -> Leg:
        if self.leg is None:
            raise LookupError("No leg has been written; put a WaypointWriter before the motion.")
        return self.leg

    def _number(self, datum: str) -> float | None:
        reading = self._context.interface.reading(datum)
        return None if reading.stale else float(reading.value)


class WaypointWriter(Behaviour):
    """Writes the next leg of the route; FAILURE if none is left, or the position stays unknown."""

    def __init__(self, name: str, context: MissionContext, route: Route) -> None:
        super().__init__(name)
        self._context = context
        self.route = route
        self._asked_at = 0.0

    def initialise(self) -> None:
        self._asked_at = self._context.now()

    def update(self) -> Status:
        if not self.route.write():
            return _wait_for_position(self, self._context, self._asked_at)
        planner, leg = self.route.planner, self.route.leg
        if leg is None:
            self.feedback_message = f"{planner.reached} of {len(planner.route)} waypoints reached, none left"
            return Status.FAILURE
        x, y, z = leg.target
        self.feedback_message = f"waypoint {planner.waypoint + 1} of {len(planner.route)}: to {x:.1f}, {y:.1f}, {z:.1f}"
        return Status.SUCCESS


class PointAbove(Behaviour):
    """Writes the point at `height` (m, ENU) straight above the robot, or its own position if that is higher.

    FAILURE if the position stays unknown.
    """

    def __init__(self, name: str, context: MissionContext, height: float) -> None:
        super().__init__(name)
        self.height = height
        self._context = context
        self._point: Position | None = None
        self._asked_at = 0.0

    def target(self) -> dict[str, float]:
        """The latest point, as an input of a motion skill."""
        if self._point is None:
            raise LookupError("No point has been written; put a PointAbove before the motion.")
        return dict(zip("xyz", self._point, strict=True))

    def initialise(self) -> None:
        self._asked_at = self._context.now()

    def update(self) -> Status:
        position = fresh_position(self._context)
        if position is None:
            return _wait_for_position(self, self._context, self._asked_at)
        x, y, z = position
        self._point = x, y, max(z, self.height)
        self.feedback_message = f"to {self._point[2]:.1f} m"
        return Status.SUCCESS


class RouteFulfilled(Behaviour):
    """SUCCESS if the route counts as done; else FAILURE, with the summary of its waypoints."""

    def __init__(self, name: str, context: MissionContext, route: Route) -> None:
        super().__init__(name)
        self._context = context
        self.route = route
        self._planner = route.planner

    def update(self) -> Status:
        self.feedback_message = self._planner.summary
        if self._planner.fulfilled:
            return Status.SUCCESS
        self._context.observe(self.feedback_message, None, failed=True)
        return Status.FAILURE


def _leg(position: Position, heading: float, target: Position) -> Leg:
    direction = bearing(position, target)
    return Leg(target, heading if direction is None else crab_heading(direction, heading))


def fresh_position(context: MissionContext) -> Position | None:
    """Position of the robot; None if it is unknown or stale."""
    reading = context.interface.reading("position")
    return None if reading.stale else _position(reading.value)


def _wait_for_position(leaf: Behaviour, context: MissionContext, since: float) -> Status:
    if context.now() - since < POSITION_PATIENCE:
        leaf.feedback_message = "waiting for a fresh position"
        return Status.RUNNING
    leaf.feedback_message = f"position or heading is not known for {POSITION_PATIENCE:g} s"
    context.observe(leaf.feedback_message, None, failed=True)
    return Status.FAILURE


def _position(value: object) -> Position | None:
    if not isinstance(value, Mapping):
        return None
    fields = cast(Mapping[str, Any], value)
    return float(fields["x"]), float(fields["y"]), float(fields["z"])
