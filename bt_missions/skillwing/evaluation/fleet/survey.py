"""The mission of two drones that share a pad: each maps its half of a courtyard, then both land on the pad in turn."""

from __future__ import annotations

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
from skillwing.bt_missions.planning.detour import Position
from skillwing.bt_missions.subtrees.composites import alongside, first_that_works, in_order
from skillwing.bt_missions.subtrees.lease import WithLease
from skillwing.bt_missions.subtrees.parallel_all import ParallelAll

DRONES = ("left", "right")
YARD = "yard"
VISIT_LIMIT = 180.0
"""Longest visit to the pad, from the grant of the lease on, in seconds of robot time."""


class SurveyOptions(MissionOptions, frozen=True, kw_only=True):
    """Options by drone; lengths in metres, ENU.

    mapping: of the mapping mission of each drone; its speed is that of the visit, too. homes: place of each drone on
    the ground, and the height of its visit to the pad. patience: longest wait for the pad in seconds, of which a visit
    of the other drone is a part.
    """

    mapping: dict[str, MappingMissionOptions]
    homes: dict[str, Position]
    patience: Annotated[float, msgspec.Meta(ge=0.0)] = 240.0


class Survey(Mission):
    name = "survey"
    summary = "Two drones map a half of a courtyard each, and land on the one pad that they share, one after the other."
    robots = (*DRONES, YARD)
    needs = MappingProxyType(
        {f"{drone}.{name}": states for drone in DRONES for name, states in MappingMission.needs.items()}
    )
    Options = SurveyOptions

    def build(self, context: MissionContext, options: SurveyOptions) -> MissionTrees:
        both = ParallelAll("both", [_map_and_visit(context, drone, options) for drone in DRONES])
        return MissionTrees(both, rescues={drone: rescue(context.of(drone)) for drone in DRONES})


def _map_and_visit(context: MissionContext, drone: str, options: SurveyOptions) -> Behaviour:
    """The mapping mission of one drone, with its landing at home, and then its visit to the pad."""
    mapping = MappingMission().build(context.of(drone), options.mapping[drone])
    return in_order(drone, mapping.root, _visit(context, drone, options))


def _visit(context: MissionContext, drone: str, options: SurveyOptions) -> Behaviour:
    """The visit under the lease of the pad. A drone that loses the lease in the air lands where it is.

    Where the yard sees the drone in the place of the pad, nobody else gets the pad. So the drone goes on there.
    """
    own, yard, mapping = context.of(drone), context.of(YARD), options.mapping[drone]
    visit = first_that_works(
        "by camera or LiDAR", _pad_and_home(own, CAMERA, drone, options), _pad_and_home(own, LIDAR, drone, options)
    )
    lent = WithLease(
        "pad",
        yard,
        SkillAction("hold the pad", yard, "hold_pad", {"holder": drone}),
        guarded_flight(own, visit, Success("visited"), time_limit=VISIT_LIMIT, pilot_patience=mapping.pilot_patience),
        DataCompare("on the pad?", yard, "pad_robot", "==", drone),
        patience=options.patience,
    )
    return first_that_works("visit or land", lent, SuccessIsFailure("landed, but no visit", land_where_it_is(own)))


def _pad_and_home(own: MissionContext, sensor: Sensor, drone: str, options: SurveyOptions) -> Behaviour:
    """A visit with one sensor: to the pad, down to it, up again, and to above the home."""
    x, y, height = options.homes[drone]
    speed = options.mapping[drone].speed
    return in_order(
        f"visit by {sensor.name}",
        ResourceIs(f"{sensor.name} works?", own, sensor.status, "OK"),
        take_off(own, height),
        flown_with(own, sensor, "to the pad", _hop(own, sensor, "over the pad", (0.0, 0.0, height), speed)),
        landed(own),
        take_off(own, height),
        flown_with(own, sensor, "away from the pad", _hop(own, sensor, "over home", (x, y, height), speed)),
    )


def _hop(own: MissionContext, sensor: Sensor, name: str, target: Position, speed: float) -> Behaviour:
    """A short way north or south: nose first by the camera, or with the nose to the east by the LiDAR."""
    inputs = {"target": dict(zip("xyz", target, strict=True)), "speed": speed}
    if sensor is CAMERA:
        return SkillAction(name, own, "goto_straight", inputs)
    east = {"heading": 0.0}
    return in_order(
        name,
        SkillAction("nose to the east", own, "rotate_head", east),
        alongside(
            "crab",
            SkillAction("lock_head", own, "lock_head", east),
            until=SkillAction(name, own, "goto", inputs),
        ),
    )


MISSION = Survey()
