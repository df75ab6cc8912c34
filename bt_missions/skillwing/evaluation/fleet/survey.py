"""The mission of a drone that shares a pad and a corridor: it maps its part of a courtyard, then lands on the pad."""

from __future__ import annotations

from itertools import pairwise
from types import MappingProxyType
from typing import Annotated

import msgspec
from py_trees.behaviour import Behaviour
from py_trees.behaviours import Success
from py_trees.decorators import SuccessIsFailure

from skillwing.bt_missions.drone.depth_map import CAMERA, LIDAR, Sensor, flown_with
from skillwing.bt_missions.drone.flight import guarded_flight, land_where_it_is, landed, rescue, take_off
from skillwing.bt_missions.leaves.conditions import DataCompare, ResourceIs
from skillwing.bt_missions.leaves.context import MissionContext
from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.bt_missions.mission.mission import Mission, MissionOptions, MissionTrees
from skillwing.bt_missions.missions.mapping import MappingMission, MappingMissionOptions
from skillwing.bt_missions.planning.detour import Position, bearing, crab_heading
from skillwing.bt_missions.subtrees.composites import alongside, first_that_works, in_order
from skillwing.bt_missions.subtrees.lease import WithLease

DRONE, YARD = "drone", "yard"
"""Names of the robots in the mission."""
HOME, GATE, PAD = "home", "gate", "pad"
"""Places over which a drone flies in its visit."""
VISIT_LIMIT = 300.0
"""Longest visit, from the grant of the lease of the pad on, with the waits for the corridor [robot s]."""


class SurveyOptions(MissionOptions, frozen=True, kw_only=True):
    """Options; lengths in metres, ENU.

    holder: name of the drone in the yard. mapping: of the mapping mission; its speed is that of the visit, too. home:
    place of the drone on the ground, and the height of its visit to the pad. gate: place in the corridor where the
    drone enters and leaves. patience: longest wait for each place in seconds, with the visit of another drone.
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
    """The visit under the lease of the pad. A drone that loses the lease in the air lands where it is.

    Where the yard sees the drone in the place of the pad, nobody else gets the pad. So the drone goes on there.
    """
    visit = in_order("visit", _to_the_pad(own, yard, options), _home(own, yard, options))
    patience = options.mapping.pilot_patience
    lent = _under_lease(
        yard,
        "pad",
        "pad",
        guarded_flight(own, visit, Success("visited"), time_limit=VISIT_LIMIT, pilot_patience=patience),
        _seen_in(yard, "pad", options),
        options,
    )
    return first_that_works("visit or land", lent, SuccessIsFailure("landed, but no visit", land_where_it_is(own)))


def _to_the_pad(own: MissionContext, yard: MissionContext, options: SurveyOptions) -> Behaviour:
    """Take-off, way through the corridor, and landing on the pad. The lease of the pad lets the drone go on there."""

    def by(sensor: Sensor) -> Behaviour:
        # A landing may go aside, to free ground. Only one that the yard sees on the pad is a visit.
        way = _way(own, sensor, "to the pad", options, HOME, GATE, PAD)
        return in_order(f"there by {sensor.name}", way, landed(own), _seen_in(yard, "pad", options))

    inside = first_that_works("inside?", _seen_in(yard, "pad", options), _seen_in(yard, "corridor", options))
    there = first_that_works("there by camera or LiDAR", by(CAMERA), by(LIDAR))
    return _under_lease(yard, "corridor in", "corridor", there, inside, options)


def _home(own: MissionContext, yard: MissionContext, options: SurveyOptions) -> Behaviour:
    """Take-off from the pad, and way through the corridor to above the home."""
    ways = (_way(own, sensor, "away from the pad", options, PAD, GATE, HOME) for sensor in (CAMERA, LIDAR))
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
    """Take-off at the first place, and straight hops with one sensor to the others."""
    x, y, height = options.home
    over = {HOME: (x, y, height), GATE: (*options.gate, height), PAD: (0.0, 0.0, height)}
    hops = [
        _hop(own, sensor, f"over the {end}", over[start], over[end], options.mapping.speed)
        for start, end in pairwise(places)
    ]
    return in_order(
        f"{name} by {sensor.name}",
        ResourceIs(f"{sensor.name} works?", own, sensor.status, "OK"),
        take_off(own, height),
        flown_with(own, sensor, name, *hops),
    )


def _hop(own: MissionContext, sensor: Sensor, name: str, start: Position, end: Position, speed: float) -> Behaviour:
    """A short straight way: nose first by the camera, or with the nose across the motion by the LiDAR."""
    inputs = {"target": dict(zip("xyz", end, strict=True)), "speed": speed}
    if sensor is CAMERA:
        return SkillAction(name, own, "goto_straight", inputs)
    across = {"heading": crab_heading(bearing(start, end) or 0.0, 0.0)}
    return in_order(
        f"crab {name}",
        SkillAction("nose across", own, "rotate_head", across),
        alongside(
            "crab",
            SkillAction("lock_head", own, "lock_head", across),
            until=SkillAction(name, own, "goto", inputs),
        ),
    )


MISSION = Survey()
