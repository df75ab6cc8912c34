"""The mission of a drone that shares a pad and a corridor: it maps its part of a courtyard, then lands on the pad."""

from __future__ import annotations

from types import MappingProxyType
from typing import Annotated

import msgspec
from py_trees.behaviour import Behaviour
from py_trees.behaviours import Success

from skillwing.bt_missions.drone.depth_map import CAMERA, LIDAR, Sensor, flown_with
from skillwing.bt_missions.drone.flight import guarded_flight, landed, rescue, take_off
from skillwing.bt_missions.leaves.conditions import DataCompare, ResourceIs
from skillwing.bt_missions.leaves.context import MissionContext
from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.bt_missions.mission.mission import Mission, MissionOptions, MissionTrees
from skillwing.bt_missions.missions.mapping import MappingMission, MappingMissionOptions
from skillwing.bt_missions.planning.detour import Position, bearing, crab_heading
from skillwing.bt_missions.planning.waypoints import fresh_position
from skillwing.bt_missions.subtrees.composites import alongside, first_that_works, in_order
from skillwing.bt_missions.subtrees.lease import WithLease

DRONE, YARD = "drone", "yard"
"""Names of the robots in the mission."""
HOME, GATE, PAD = "home", "gate", "pad"
"""Places over which a drone flies in its visit."""
VISIT_LIMIT = 180.0
"""Longest visit without the waits for leases [robot s]."""
LEASES = 3
"""Leases of a visit: the pad, and the corridor for each way."""


class SurveyOptions(MissionOptions, frozen=True, kw_only=True):
    """Options; lengths in metres, ENU.

    holder: name of the drone in the yard. mapping: of the mapping mission; its speed is that of the visit, too. home:
    place of the drone on the ground, and the height of its visit to the pad. gate: place in the corridor where the
    drone enters and leaves. patience: longest wait for each lease in seconds, of which a visit of another drone is a
    part.
    """

    holder: str
    mapping: MappingMissionOptions
    home: Position
    gate: tuple[float, float]
    patience: Annotated[float, msgspec.Meta(ge=0.0)] = 240.0


class Survey(Mission):
    name = "survey"
    summary = "A drone maps a part of a courtyard, and lands on a pad that it shares with others, through a corridor."
    robots = (DRONE, YARD)
    needs = MappingProxyType({f"{DRONE}.{name}": states for name, states in MappingMission.needs.items()})
    Options = SurveyOptions

    def build(self, context: MissionContext, options: SurveyOptions) -> MissionTrees:
        """The mapping mission with its landing at home, and then the visit to the pad."""
        own = context.of(DRONE)
        mapping = MappingMission().build(own, options.mapping)
        root = in_order(self.name, mapping.root, pad_visit(own, context.of(YARD), options))
        return MissionTrees(root, rescues={DRONE: rescue(own)})


def pad_visit(own: MissionContext, yard: MissionContext, options: SurveyOptions) -> Behaviour:
    """The visit to the pad, and the landing at home. A drone that loses a lease on its way lands where it is.

    Where the yard sees the drone in the place of that lease, nobody else gets the place. So the drone goes on there. It
    gives the pad back on the pad: nobody else gets that before the drone has left.
    """
    to_the_pad = _under_lease(
        yard, "pad", "pad", _to_the_pad(own, yard, options), _seen_in(yard, "pad", options), options
    )
    return guarded_flight(
        own,
        in_order("visit", to_the_pad, _home(own, yard, options)),
        Success("visited"),
        time_limit=LEASES * options.patience + VISIT_LIMIT,
        pilot_patience=options.mapping.pilot_patience,
    )


def _to_the_pad(own: MissionContext, yard: MissionContext, options: SurveyOptions) -> Behaviour:
    """Take-off, way through the corridor, and landing on the pad. The lease of the pad lets the drone go on there."""

    def by(sensor: Sensor) -> Behaviour:
        # A landing may go aside, to free ground. Only one that the yard sees on the pad is a visit.
        way = _way(own, sensor, "to the pad", options, GATE, PAD)
        return in_order(f"there by {sensor.name}", way, landed(own), _seen_in(yard, "pad", options))

    inside = first_that_works("inside?", _seen_in(yard, "pad", options), _seen_in(yard, "corridor", options))
    there = first_that_works("there by camera or LiDAR", by(CAMERA), by(LIDAR))
    return _under_lease(yard, "corridor in", "corridor", there, inside, options)


def _home(own: MissionContext, yard: MissionContext, options: SurveyOptions) -> Behaviour:
    """Take-off from the pad, and way through the corridor to above the home."""
    ways = (_way(own, sensor, "away from the pad", options, GATE, HOME) for sensor in (CAMERA, LIDAR))
    back = first_that_works("back by camera or LiDAR", *ways)
    return _under_lease(yard, "corridor out", "corridor", back, _seen_in(yard, "corridor", options), options)


def _under_lease(
    yard: MissionContext, name: str, place: str, body: Behaviour, stay: Behaviour, options: SurveyOptions
) -> WithLease:
    lease = SkillAction(f"hold the {name}", yard, f"hold_{place}", {"holder": options.holder})
    return WithLease(name, yard, lease, body, stay, patience=options.patience)


def _seen_in(yard: MissionContext, place: str, options: SurveyOptions) -> DataCompare:
    return DataCompare(f"in the {place}?", yard, f"{place}_robot", "==", options.holder)


def _way(own: MissionContext, sensor: Sensor, name: str, options: SurveyOptions, *places: str) -> Behaviour:
    """Take-off, and straight hops with one sensor over these places."""
    x, y, height = options.home
    over = {HOME: (x, y, height), GATE: (*options.gate, height), PAD: (0.0, 0.0, height)}
    hops = [_hop(own, sensor, f"over the {place}", over[place], options.mapping.speed) for place in places]
    return in_order(
        f"{name} by {sensor.name}",
        ResourceIs(f"{sensor.name} works?", own, sensor.status, "OK"),
        take_off(own, height),
        flown_with(own, sensor, name, *hops),
    )


def _hop(own: MissionContext, sensor: Sensor, name: str, end: Position, speed: float) -> Behaviour:
    """A short straight way: nose first by the camera, or with the nose across the motion by the LiDAR."""
    inputs = {"target": dict(zip("xyz", end, strict=True)), "speed": speed}
    if sensor is CAMERA:
        return SkillAction(name, own, "goto_straight", inputs)

    across = Across(own, end)
    return in_order(
        f"crab {name}",
        SkillAction("nose across", own, "rotate_head", {"heading": across.choose}),
        alongside(
            "crab",
            SkillAction("lock_head", own, "lock_head", {"heading": lambda: across.heading}),
            until=SkillAction(name, own, "goto", inputs),
        ),
    )


class Across:
    """Heading across the way from the present position to `end`, chosen once for each hop [rad, ENU]."""

    def __init__(self, context: MissionContext, end: Position) -> None:
        self._context = context
        self._end = end
        self.heading = 0.0

    def choose(self) -> float:
        """Choose the heading. Without a position or a way on the ground plan it stays as it was."""
        here = fresh_position(self._context)
        direction = None if here is None else bearing(here, self._end)
        if direction is not None:
            self.heading = crab_heading(direction, self.heading)
        return self.heading


MISSION = Survey()
