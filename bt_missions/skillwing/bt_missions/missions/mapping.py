"""The 3D-mapping mission of the paper (Figures 6, 7 and 10): along a route, with a way on when the camera fails.

The depth camera looks ahead, so the drone flies nose first. When the camera fails, the LiDAR takes over; its ring
sees only sideways, so the drone turns its nose across the motion and flies like a crab. Mapping runs on meanwhile.
When the LiDAR fails there is nothing left to map with: the drone comes home, by the camera if that is well.
"""

from __future__ import annotations

from types import MappingProxyType
from typing import Annotated

import msgspec
from py_trees.behaviour import Behaviour
from py_trees.behaviours import Success
from py_trees.common import Status

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
from skillwing.bt_missions.subtrees.depth_map import CAMERA, LIDAR, Sensor, come_home, flown_with
from skillwing.bt_missions.subtrees.flight import (
    PILOT_PATIENCE,
    fly_home,
    guarded_flight,
    or_pause,
    rescue,
    take_off,
)

Speed = Annotated[float, msgspec.Meta(ge=0.1, le=5.0)]

LEG_FLOWN = {
    "S_ARRIVED": Status.SUCCESS,
    # An obstacle on the way is no failure of the branch: the writer plans the next leg round it.
    "S_BLOCKED": Status.SUCCESS,
    "N_BLOCKED": Status.SUCCESS,
    # Whoever held the drone may have flown it elsewhere: the writer plans on from there, to the same waypoint.
    HELD: Status.SUCCESS,
    "S_ABORTED": Status.FAILURE,
}
NO_MAP = {"S_DIVERGED": Status.FAILURE}
ALIGNED = {"S_ALIGNED": Status.SUCCESS, HELD: Status.FAILURE}


class MappingOptions(MissionOptions, frozen=True, kw_only=True):
    """route: waypoints (x, y, z) in ENU metres, home at the origin. height: of take-off, by default the first
    waypoint's. return_height: at which to begin the flight home; it climbs over what stands in its way. area: west,
    south, east, north border of the route and its detours, inside the robot's geofence; None for anywhere. time_limit:
    robot seconds until the drone gives up and lands, pauses among them. pilot_patience: robot seconds for which the
    safety pilot may have the drone before the mission ends."""

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
            # On the ground a landing may not have let go of them yet.
            "axes_authority": ("AVAILABLE",),
            "heading_authority": ("AVAILABLE",),
            "zed_status": ("OK", "FAILED"),
            "lidar_status": ("OK",),
            "battery_status": ("NORMAL",),
        }
    )
    Options = MappingOptions

    def build(self, context: MissionContext, options: MappingOptions) -> MissionTrees:
        planner = RoutePlanner(options.route, area=options.area)
        route = Route(context, planner)
        root = guarded_flight(
            context,
            or_pause(context, _flight(context, route, options)),
            # Home again is not done, if anything but obstacles kept the drone from the waypoints.
            RouteFulfilled("route flown?", context, route),
            time_limit=options.time_limit,
            pilot_patience=options.pilot_patience,
        )
        return MissionTrees(root, rescue(context), progress=lambda: Progress.of(planner))


def _flight(context: MissionContext, route: Route, options: MappingOptions) -> Behaviour:
    """Figure 6: take off, map, return. The return is part of the navigation: the depth map watches that way as well."""
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
            # Where that fails as well, the guards above land the drone where it is.
            come_home(context, "mission", "mapping", height=options.return_height, speed=options.speed),
        ),
    )


def _navigation(context: MissionContext, route: Route, options: MappingOptions) -> Behaviour:
    """Figure 7: by the camera, or else by the LiDAR. A camera that has failed once no longer leads along the route."""
    return first_that_works("navigate", _by_camera(context, route, options), _by_lidar(context, route, options))


def _by_camera(context: MissionContext, route: Route, options: MappingOptions) -> Behaviour:
    """Nose first, looking ahead with the depth camera."""
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


def _by_lidar(context: MissionContext, route: Route, options: MappingOptions) -> Behaviour:
    """Nose across the motion, so that the LiDAR's ring looks along it."""
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
    # A nose that was held on its way round may have to turn elsewhere by now.
    leg = OnEnding("leg, or another", leg, (HELD,), Success("plan again"))
    return in_order(
        "LiDAR branch",
        NoteSwitch("why", context, "navigation", "ZED", "LiDAR"),
        ResourceIs("LiDAR?", context, LIDAR.status, "OK"),
        _route_and_home(context, LIDAR, route, leg, options),
    )


def _route_and_home(
    context: MissionContext, sensor: Sensor, route: Route, leg: Behaviour, options: MappingOptions
) -> Behaviour:
    return flown_with(
        context,
        sensor,
        "fly route and home",
        _route_or_turn_back(context, route, leg),
        fly_home(context, options.return_height, options.speed),
    )


def _route_or_turn_back(context: MissionContext, route: Route, leg: Behaviour) -> Behaviour:
    """Fly legs until the route is done, or until the battery is low: then it is time to come home.

    A critical one lands the drone where it is, which is the business of the guards above.
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
