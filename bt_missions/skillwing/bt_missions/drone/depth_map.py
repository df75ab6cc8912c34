"""Flight with a depth map, in which obstacle detection finds obstacles ahead; the way home with any working sensor."""

from __future__ import annotations

from typing import NamedTuple

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.composites import Sequence

from skillwing.bt_missions.drone.flight import STOPPING_PATIENCE, fly_home
from skillwing.bt_missions.leaves.branch_switch import NoteSwitch, WaitForSettled
from skillwing.bt_missions.leaves.conditions import ResourceIs
from skillwing.bt_missions.leaves.context import MissionContext
from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.bt_missions.subtrees.composites import OnEnding, alongside, first_that_works, in_order

NO_DEPTH_MAP = {"S_NO_DATA": Status.FAILURE}
DEPTH_MAP_WAIT = 5.0
"""Longest wait for a depth map at the start of a flight with it, in seconds of robot time."""


class Sensor(NamedTuple):
    """Sensor for a depth map. name: for people. status: resource with the sensor's state. skill: makes the depth map.
    source: state of `depthmap_source` meanwhile. looks: name of the leaf that waits for the depth map."""

    name: str
    status: str
    skill: str
    source: str
    looks: str


CAMERA = Sensor("ZED", "zed_status", "zed_depthmap", "ZED", "looking ahead")
LIDAR = Sensor("LiDAR", "lidar_status", "lidar_depthmap", "LIDAR", "looking along")


def flown_with(context: MissionContext, sensor: Sensor, name: str, *steps: Behaviour) -> Behaviour:
    """`steps` in order, once there is a depth map. Its loss ends them with FAILURE."""
    return alongside(
        f"fly with {sensor.name}",
        SkillAction(sensor.skill, context, sensor.skill, outcomes=NO_DEPTH_MAP),
        until=in_order(
            name,
            ResourceIs(sensor.looks, context, "depthmap_source", sensor.source, wait=DEPTH_MAP_WAIT),
            *steps,
        ),
    )


SENSOR_LOST = ("RI", "S_NO_DATA", "LOST")
"""Endings of a skill that lost the sensor of its depth map."""


def come_home(context: MissionContext, subject: str, doing: str, *, height: float, speed: float) -> Sequence:
    """Flight home with any sensor that works now, without a landing. FAILURE if no sensor works.

    A sensor that failed earlier and works again counts. If the LiDAR fails on the way, the camera may take over again.

    subject, doing: subject of the switch and the branch that is given up, for `NoteSwitch`. height: at the start of the
    way home, in metres. speed: in m/s.
    """

    def home_with(sensor: Sensor) -> Behaviour:
        return in_order(
            f"home with {sensor.name}",
            ResourceIs(f"{sensor.name} well?", context, sensor.status, "OK", question=True),
            NoteSwitch("why", context, subject, doing, f"coming home by {sensor.name}"),
            flown_with(context, sensor, "fly home", fly_home(context, height, speed)),
        )

    return in_order(
        "come home",
        # First the old depth map has to end.
        WaitForSettled("stopped", context, STOPPING_PATIENCE),
        first_that_works(
            "by what is left",
            home_with(CAMERA),
            OnEnding("with LiDAR, or ZED again", home_with(LIDAR), SENSOR_LOST, home_with(CAMERA)),
        ),
    )
