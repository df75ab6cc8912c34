"""Home before the mission is done, by whatever still sees."""

from __future__ import annotations

from py_trees.behaviour import Behaviour
from py_trees.composites import Sequence

from skillwing.bt_missions.leaves.branch_switch import NoteSwitch, Settled
from skillwing.bt_missions.leaves.conditions import ResourceIs
from skillwing.bt_missions.leaves.context import MissionContext
from skillwing.bt_missions.subtrees.composites import OnEnding, first_that_works, in_order
from skillwing.bt_missions.subtrees.depth_map import CAMERA, LIDAR, Sensor, flown_with
from skillwing.bt_missions.subtrees.flight import fly_home
from skillwing.bt_missions.subtrees.landing import STOPPING_PATIENCE

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
        Settled("stopped", context, STOPPING_PATIENCE),
        first_that_works(
            "by what is left",
            home_with(CAMERA),
            OnEnding("with LiDAR, or ZED again", home_with(LIDAR), SENSOR_LOST, home_with(CAMERA)),
        ),
    )
