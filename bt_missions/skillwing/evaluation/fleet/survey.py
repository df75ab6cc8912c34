"""The mission of a drone that shares a pad with others: it maps its part of a courtyard, and then lands on the pad."""

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

DRONE, YARD = "drone", "yard"
"""Names of the robots in the mission."""
VISIT_LIMIT = 180.0
"""Longest visit to the pad, from the grant of the lease on, in seconds of robot time."""


class SurveyOptions(MissionOptions, frozen=True, kw_only=True):
    """Options; lengths in metres, ENU.

    holder: name of the drone in the yard. mapping: of the mapping mission; its speed is that of the visit, too. home:
    place of the drone on the ground, and the height of its visit to the pad. patience: longest wait for the pad in
    seconds, of which a visit of another drone is a part.
    """

    holder: str
    mapping: MappingMissionOptions
    home: Position
    patience: Annotated[float, msgspec.Meta(ge=0.0)] = 240.0


class Survey(Mission):
    name = "survey"
    summary = "A drone maps a part of a courtyard, and lands on the pad that it shares with others."
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
    visit = first_that_works(
        "by camera or LiDAR", _pad_and_home(own, yard, CAMERA, options), _pad_and_home(own, yard, LIDAR, options)
    )
    patience = options.mapping.pilot_patience
    lent = WithLease(
        "pad",
        yard,
        SkillAction("hold the pad", yard, "hold_pad", {"holder": options.holder}),
        guarded_flight(own, visit, Success("visited"), time_limit=VISIT_LIMIT, pilot_patience=patience),
        _on_the_pad(yard, options.holder),
        patience=options.patience,
    )
    return first_that_works("visit or land", lent, SuccessIsFailure("landed, but no visit", land_where_it_is(own)))


def _pad_and_home(own: MissionContext, yard: MissionContext, sensor: Sensor, options: SurveyOptions) -> Behaviour:
    """A visit with one sensor: to the pad, down to it, up again, and to above the home.

    A landing may go aside, to free ground. Only one that the yard sees on the pad is a visit.
    """
    x, y, height = options.home
    speed = options.mapping.speed
    return in_order(
        f"visit by {sensor.name}",
        ResourceIs(f"{sensor.name} works?", own, sensor.status, "OK"),
        take_off(own, height),
        flown_with(own, sensor, "to the pad", _hop(own, sensor, "over the pad", (0.0, 0.0, height), speed)),
        landed(own),
        _on_the_pad(yard, options.holder),
        take_off(own, height),
        flown_with(own, sensor, "away from the pad", _hop(own, sensor, "over home", (x, y, height), speed)),
    )


def _on_the_pad(yard: MissionContext, holder: str) -> DataCompare:
    return DataCompare("on the pad?", yard, "pad_robot", "==", holder)


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
