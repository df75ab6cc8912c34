"""Flying with a depth map, in which obstacle detection looks for what stands in the way."""

from __future__ import annotations

from typing import NamedTuple

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from skillwing.bt_missions.leaves.conditions import ResourceIs
from skillwing.bt_missions.leaves.context import MissionContext
from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.bt_missions.subtrees.composites import alongside, in_order

NO_DEPTH_MAP = {"S_NO_DATA": Status.FAILURE}
DEPTH_MAP_WAIT = 5.0
"""How long a depth map may take to come up before what flies by it fails, in seconds of robot time."""


class Sensor(NamedTuple):
    """One that a depth map can be made from. name: in words. status: the resource that tells whether it is well.
    skill: makes the depth map. source: state of `depthmap_source` meanwhile. looks: where to, as a leaf is named."""

    name: str
    status: str
    skill: str
    source: str
    looks: str


CAMERA = Sensor("ZED", "zed_status", "zed_depthmap", "ZED", "looking ahead")
LIDAR = Sensor("LiDAR", "lidar_status", "lidar_depthmap", "LIDAR", "looking along")


def flown_with(context: MissionContext, sensor: Sensor, name: str, *steps: Behaviour) -> Behaviour:
    """`steps` in order, from the moment there is a depth map; without it they end, and that is a FAILURE."""
    return alongside(
        f"fly with {sensor.name}",
        SkillAction(sensor.skill, context, sensor.skill, outcomes=NO_DEPTH_MAP),
        until=in_order(
            name,
            ResourceIs(sensor.looks, context, "depthmap_source", sensor.source, wait=DEPTH_MAP_WAIT),
            *steps,
        ),
    )
