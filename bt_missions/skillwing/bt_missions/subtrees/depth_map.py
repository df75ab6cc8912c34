"""Flying with a depth map, in which obstacle detection looks for what stands in the way."""

from __future__ import annotations

from typing import NamedTuple

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.composites import Sequence

from skillwing.bt_missions.leaves.branch_switch import NoteSwitch, WaitForSettled
from skillwing.bt_missions.leaves.conditions import ResourceIs
from skillwing.bt_missions.leaves.context import MissionContext
from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.bt_missions.subtrees.composites import OnEnding, alongside, first_that_works, in_order
from skillwing.bt_missions.subtrees.flight import STOPPING_PATIENCE, fly_home

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


SENSOR_LOST = ("RI", "S_NO_DATA", "LOST")
"""How a depth map ends that can no longer be made from its sensor."""


def come_home(context: MissionContext, subject: str, doing: str, *, height: float, speed: float) -> Sequence:
    """Home by whichever sensor is well now, be it one that had failed before, and no landing. FAILURE: there is none.

    The camera may be lost, the LiDAR lead on and be lost as well: then a camera that is well again leads once more.

    subject, doing: what is noted as given up, as `NoteSwitch` has them. height: at which to begin, in metres. speed: in
    m/s.
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
        # The new depth map is not to be taken for the old one, nor a sensor for well that fails at the same moment.
        WaitForSettled("stopped", context, STOPPING_PATIENCE),
        first_that_works(
            "by what is left",
            home_with(CAMERA),
            OnEnding("with LiDAR, or ZED again", home_with(LIDAR), SENSOR_LOST, home_with(CAMERA)),
        ),
    )
