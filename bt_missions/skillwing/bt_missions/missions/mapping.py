"""The 3D-mapping mission of the paper (Figures 6, 7 and 10): a route that continues when the depth camera fails.

The depth camera looks ahead, so the drone flies nose first. If the camera fails, the LiDAR takes over. Its ring sees
only sideways, so the drone turns its nose across the motion (crab flight). Mapping continues meanwhile. If the LiDAR
fails, there is no sensor for the map: the drone comes home, with the camera if that works.
"""

from __future__ import annotations

from types import MappingProxyType
from typing import Annotated

import msgspec
from py_trees.behaviour import Behaviour
from py_trees.behaviours import Success
from py_trees.common import Status

from skillwing.bt_missions.drone.depth_map import CAMERA, LIDAR, Sensor, come_home, flown_with
from skillwing.bt_missions.drone.flight import (
    PILOT_PATIENCE,
    fly_home,
    guarded_flight,
    or_pause,
    rescue,
    take_off,
)
from skillwing.bt_missions.leaves.branch_switch import NoteSwitch
from skillwing.bt_missions.leaves.conditions import ResourceIs
from skillwing.bt_missions.leaves.context import MissionContext
from skillwing.bt_missions.leaves.pause_gate import HELD
from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.bt_missions.mission.mission import Mission, MissionOptions, MissionTrees, Progress
from skillwing.bt_missions.planning.detour import Position, RoutePlanner
from skillwing.bt_missions.planning.known_space import Area
from skillwing.bt_missions.planning.waypoints import Route, RouteFulfilled, WaypointWriter
from skillwing.bt_missions.subtrees.composites import OnEnding, alongside, first_that_works, guarded, in_order
from skillwing.bt_missions.subtrees.decorators import RepeatUntil

Speed = Annotated[float, msgspec.Meta(ge=0.1, le=5.0)]

LEG_FLOWN = {
    "S_ARRIVED": Status.SUCCESS,
    # An obstacle is not a failure of the branch: the writer plans the next leg round it.
    "S_BLOCKED": Status.SUCCESS,
    "N_BLOCKED": Status.SUCCESS,
    # The safety pilot may have flown the drone elsewhere: the writer plans from there, to the same waypoint.
    HELD: Status.SUCCESS,
    "S_ABORTED": Status.FAILURE,
}
NO_MAP = {"S_DIVERGED": Status.FAILURE}
ALIGNED = {"S_ALIGNED": Status.SUCCESS, HELD: Status.FAILURE}


class MappingMissionOptions(MissionOptions, frozen=True, kw_only=True):
    """Options; lengths in metres, speed in m/s, times in seconds of robot time.

    route: waypoints (x, y, z), ENU, home at the origin. height: of the take-off; by default that of the first waypoint.
    return_height: at the start of the way home, which climbs over obstacles. area: west, south, east and north border
    of route and detours, inside the geofence of the robot; None for no border. time_limit: time until the drone lands
    in any case, pauses included. pilot_patience: longest time with the safety pilot before the mission ends.
    """

    route: Annotated[tuple[Position, ...], msgspec.Meta(min_length=1, max_length=1000)] = (
        (30.0, 0.0, 4.0),
        (30.0, 20.0, 4.0),
        (5.0, 20.0, 4.0),
        (0.0, 0.0, 4.0),
    )
    height: Annotated[float, msgspec.Meta(ge=1.0, le=50.0)] | None = None
    return_height: Annotated[float, msgspec.Meta(ge=1.0, le=50.0)] = 12.0
    speed: Speed = 2.0
    area: Area | None = (-11.0, -11.0, 41.0, 31.0)
    time_limit: Annotated[float, msgspec.Meta(gt=0.0)] = 900.0
    pilot_patience: Annotated[float, msgspec.Meta(ge=0.0)] = PILOT_PATIENCE

    def __post_init__(self) -> None:
        if self.area is None:
            return
        west, south, east, north = self.area
        for number, (x, y, _) in enumerate(self.route, start=1):
            if not (west <= x <= east and south <= y <= north):
                where = f"Waypoint {number} of `route` ({x:g}, {y:g}) lies outside `area`"
                raise ValueError(f"{where}. Move it inside, or give a larger `area`.")


class MappingMission(Mission):
    name = "mapping"
    summary = "Map the surroundings of a route with the LiDAR; fly on by LiDAR when the depth camera fails."
    needs = MappingProxyType(
        {
            "SDK_authority": ("AVAILABLE",),
            "homepoint_status": ("VALID",),
            "flight_status": ("ON_GROUND",),
            # A landing may still hold these two on the ground.
            "axes_authority": ("AVAILABLE",),
            "heading_authority": ("AVAILABLE",),
            "zed_status": ("OK", "FAILED"),
            "lidar_status": ("OK",),
            "battery_status": ("NORMAL",),
        }
    )
    Options = MappingMissionOptions

    def build(self, context: MissionContext, options: MappingMissionOptions) -> MissionTrees:
        planner = RoutePlanner(options.route, area=options.area)
        route = Route(context, planner)
        root = guarded_flight(
            context,
            or_pause(context, _flight(context, route, options)),
            # A drone at home is not enough: only obstacles may be the reason for a waypoint that was left out.
            RouteFulfilled("route flown?", context, route),
            time_limit=options.time_limit,
            pilot_patience=options.pilot_patience,
        )
        return MissionTrees(root, rescue(context), progress=lambda: Progress.of(planner))


def _flight(context: MissionContext, route: Route, options: MappingMissionOptions) -> Behaviour:
    """Figure 6: take off, map, return. The return is part of the navigation, as it needs the depth map as well."""
    height = options.height if options.height is not None else options.route[0][2]
    mapping = alongside(
        "map",
        SkillAction("lidar_mapping", context, "lidar_mapping", outcomes=NO_MAP),
        until=_navigation(context, route, options),
    )
    return in_order(
        "flight",
        take_off(context, height),
        first_that_works(
            "map or come home",
            mapping,
            # If that fails as well, the guards above land the drone where it is.
            come_home(context, "mission", "mapping", height=options.return_height, speed=options.speed),
        ),
    )


def _navigation(context: MissionContext, route: Route, options: MappingMissionOptions) -> Behaviour:
    """Figure 7: by the camera, or else by the LiDAR. A camera that has failed is not used along the route again."""
    return first_that_works("navigate", _by_camera(context, route, options), _by_lidar(context, route, options))


def _by_camera(context: MissionContext, route: Route, options: MappingMissionOptions) -> Behaviour:
    """Legs nose first, with the depth camera looking ahead."""
    fly_leg = SkillAction(
        "goto_straight",
        context,
        "goto_straight",
        {"target": route.target, "speed": options.speed},
        outcomes=LEG_FLOWN,
        on_end=route.leg_ended,
    )
    leg = in_order("leg", WaypointWriter("WaypointWriter", context, route), fly_leg)
    return in_order(
        "ZED branch",
        ResourceIs("camera?", context, CAMERA.status, "OK"),
        _route_and_home(context, CAMERA, route, leg, options),
    )


def _by_lidar(context: MissionContext, route: Route, options: MappingMissionOptions) -> Behaviour:
    """Legs with the nose across the motion, so that the LiDAR's ring covers the way ahead."""
    heading = {"heading": route.crab}
    fly_leg = SkillAction(
        "goto",
        context,
        "goto",
        {"target": route.target, "speed": options.speed},
        outcomes=LEG_FLOWN,
        on_end=route.leg_ended,
    )
    leg = in_order(
        "leg",
        WaypointWriter("WaypointWriter", context, route),
        SkillAction("rotate_head", context, "rotate_head", heading, outcomes=ALIGNED),
        alongside(
            "crab",
            SkillAction("lock_head", context, "lock_head", heading),
            until=fly_leg,
        ),
    )
    # After a hold during the turn, the next leg may need another heading.
    leg = OnEnding("leg, or another", leg, (HELD,), Success("plan again"))
    return in_order(
        "LiDAR branch",
        NoteSwitch("why", context, "navigation", "ZED", "LiDAR"),
        ResourceIs("LiDAR?", context, LIDAR.status, "OK"),
        _route_and_home(context, LIDAR, route, leg, options),
    )


def _route_and_home(
    context: MissionContext, sensor: Sensor, route: Route, leg: Behaviour, options: MappingMissionOptions
) -> Behaviour:
    return flown_with(
        context,
        sensor,
        "fly route and home",
        _route_or_turn_back(context, route, leg),
        fly_home(context, options.return_height, options.speed),
    )


def _route_or_turn_back(context: MissionContext, route: Route, leg: Behaviour) -> Behaviour:
    """Legs until the route is done. A LOW battery ends them early, so that the drone comes home.

    A CRITICAL battery is for the guards above: they land the drone where it is.
    """
    return first_that_works(
        "route or turn back",
        guarded(
            "while there is charge",
            ResourceIs("charged?", context, "battery_status", "NORMAL"),
            RepeatUntil("until the route is done", route.is_done, leg),
        ),
        in_order(
            "turn back",
            ResourceIs("low battery?", context, "battery_status", "LOW", question=True),
            NoteSwitch("why", context, "mission", "mapping", "coming home early"),
        ),
    )


MISSION = MappingMission()
