"""The inspection mission of the paper (Sections 2.1 and 6.2): a circle round a building, with live video.

A flight beyond the pilot's line of sight needs live video all the way. If the link loses it, the drone stops, hovers
for some seconds, and lands where it is. If the LiDAR fails while there is video, the drone comes home.
"""

from __future__ import annotations

from types import MappingProxyType
from typing import Annotated

import msgspec
from py_trees.behaviour import Behaviour
from py_trees.common import Status

from skillwing.bt_missions.drone.depth_map import LIDAR, come_home, flown_with
from skillwing.bt_missions.drone.flight import (
    PILOT_PATIENCE,
    fly_home,
    guarded_flight,
    or_pause,
    rescue,
    take_off,
)
from skillwing.bt_missions.leaves.branch_switch import NeverSwitched, NoteSwitch
from skillwing.bt_missions.leaves.conditions import ResourceIs
from skillwing.bt_missions.leaves.context import MissionContext
from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.bt_missions.mission.mission import Mission, MissionOptions, MissionTrees, Progress
from skillwing.bt_missions.planning.detour import Position
from skillwing.bt_missions.subtrees.composites import alongside, first_that_works, guarded, in_order

INSPECTED = {"S_COMPLETED": Status.SUCCESS, "S_BLOCKED": Status.FAILURE, "S_ABORTED": Status.FAILURE}
NO_VIDEO = {"S_FPS_LOST": Status.FAILURE}
HOVERED = {"S_DONE": Status.SUCCESS}


class InspectionOptions(MissionOptions, frozen=True, kw_only=True):
    """Options; lengths in metres, speed in m/s, times in seconds of robot time.

    center: of the building, ENU, home at the origin. radius, height: of the circle; the take-off has the same height.
    laps: number of laps. return_height: at the start of the way home, which climbs over obstacles.
    min_fps, min_quality: of the video; quality is SSIM, 1 is perfect. hover: time from the loss of the video to the
    landing. time_limit: time until the drone lands in any case, pauses included. pilot_patience: longest time with the
    safety pilot before the mission ends.
    """

    center: Position = (28.0, 0.0, 0.0)
    radius: Annotated[float, msgspec.Meta(ge=2.0, le=100.0)] = 20.0
    height: Annotated[float, msgspec.Meta(ge=1.0, le=50.0)] = 12.0
    laps: Annotated[float, msgspec.Meta(ge=0.1, le=20.0)] = 1.0
    speed: Annotated[float, msgspec.Meta(ge=0.1, le=5.0)] = 2.0
    return_height: Annotated[float, msgspec.Meta(ge=1.0, le=50.0)] = 12.0
    min_fps: Annotated[float, msgspec.Meta(ge=1.0, le=25.0)] = 10.0
    min_quality: Annotated[float, msgspec.Meta(ge=0.0, le=1.0)] = 0.7
    hover: Annotated[float, msgspec.Meta(ge=0.0, le=3600.0)] = 4.0
    time_limit: Annotated[float, msgspec.Meta(gt=0.0)] = 900.0
    pilot_patience: Annotated[float, msgspec.Meta(ge=0.0)] = PILOT_PATIENCE


class InspectionMission(Mission):
    name = "inspection"
    summary = "Fly round a building with live video; hover and land when the link can carry it no longer."
    needs = MappingProxyType(
        {
            "SDK_authority": ("AVAILABLE",),
            "homepoint_status": ("VALID",),
            "flight_status": ("ON_GROUND",),
            "axes_authority": ("AVAILABLE",),
            "heading_authority": ("AVAILABLE",),
            "lidar_status": ("OK",),
            "link_status": ("GOOD",),
            "battery_status": ("NORMAL",),
        }
    )
    Options = InspectionOptions

    def build(self, context: MissionContext, options: InspectionOptions) -> MissionTrees:
        root = guarded_flight(
            context,
            _inspection(context, options),
            # A drone at home is not enough: it may have turned back before the last lap.
            NeverSwitched("as planned?", context, "inspection"),
            time_limit=options.time_limit,
            pilot_patience=options.pilot_patience,
        )
        return MissionTrees(root, rescue(context), progress=Progress)


def _inspection(context: MissionContext, options: InspectionOptions) -> Behaviour:
    """Section 2.1: Selector(Parallel(stream, inspect) ; hover, land). The landing is that of every guarded flight.

    The part without video cannot be paused, as the drone must not stay in the air there.
    """
    flight = in_order("flight", take_off(context, options.height), _with_video(context, options))
    return first_that_works(
        "the inspection",
        or_pause(context, flight),
        in_order(
            "hover, then land",
            NoteSwitch("why", context, "inspection", "flying with video", "landing where it is"),
            SkillAction("hover", context, "hover", {"duration": options.hover}, outcomes=HOVERED),
        ),
    )


def _with_video(context: MissionContext, options: InspectionOptions) -> Behaviour:
    """Circle and way home, with live video, by any sensor that works."""
    demands = {"min_fps": options.min_fps, "min_quality": options.min_quality}
    return alongside(
        "with video",
        SkillAction("stream", context, "stream", demands, outcomes=NO_VIDEO),
        until=first_that_works(
            "inspect or come home",
            _by_lidar(context, options),
            come_home(context, "inspection", "inspecting", height=options.return_height, speed=options.speed),
        ),
    )


def _by_lidar(context: MissionContext, options: InspectionOptions) -> Behaviour:
    """Circle and way home by LiDAR. The nose points at the building, so the LiDAR's ring covers the way ahead."""
    return flown_with(
        context,
        LIDAR,
        "fly round and home",
        first_that_works(
            "inspect or turn back",
            guarded(
                "while there is charge",
                ResourceIs("charged?", context, "battery_status", "NORMAL"),
                _round(context, options),
            ),
            NoteSwitch("why", context, "inspection", "inspecting", "coming home early"),
        ),
        fly_home(context, options.return_height, options.speed),
    )


def _round(context: MissionContext, options: InspectionOptions) -> SkillAction:
    circle = {
        "center": dict(zip("xyz", options.center, strict=True)),
        "radius": options.radius,
        "height": options.height,
        "laps": options.laps,
        "speed": options.speed,
    }
    return SkillAction("inspect", context, "inspect", circle, outcomes=INSPECTED, done={"laps": "laps_done"})


MISSION = InspectionMission()
