"""Mapping with another reaction to the camera's failure, for comparison with the library's mission.

Not for real flights: one of the reactions is none, and a new branch can be held neither by the operator nor by the
safety pilot. The tree is the library's with its LiDAR branch removed or exchanged, and without the return for want of
a map.
"""

from __future__ import annotations

from typing import Literal

import msgspec
from py_trees.behaviour import Behaviour
from py_trees.composites import Composite

from skillwing.bt_missions.drone.depth_map import LIDAR, flown_with
from skillwing.bt_missions.drone.flight import fly_home
from skillwing.bt_missions.leaves.branch_switch import NoteSwitch
from skillwing.bt_missions.leaves.context import MissionContext
from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.bt_missions.mission.mission import MissionTrees
from skillwing.bt_missions.missions.mapping import LEG_FLOWN, MappingMission, MappingMissionOptions
from skillwing.bt_missions.planning.waypoints import Route, WaypointWriter
from skillwing.bt_missions.subtrees.composites import in_order
from skillwing.bt_missions.subtrees.decorators import RepeatUntil

TIME_LIMIT = 240.0
"""Robot seconds until one that flies blind lands: a drone that hangs on a wall does not end by itself."""


class MappingOtherwiseOptions(MappingMissionOptions, frozen=True, kw_only=True):
    """instead: no alternative, so that the guards above land the drone at once; come home at once; or fly on along the
    route with nothing that looks ahead."""

    instead: Literal["land", "home", "blind"]


class MappingOtherwise(MappingMission):
    Options = MappingOtherwiseOptions

    def build(self, context: MissionContext, options: MappingMissionOptions) -> MissionTrees:
        assert isinstance(options, MappingOtherwiseOptions), "a mission is built with options of its own"
        limited = msgspec.structs.replace(options, time_limit=TIME_LIMIT) if options.instead == "blind" else options
        trees = super().build(context, limited)
        nodes = list(trees.root.iterate())
        route = next(node.route for node in nodes if isinstance(node, WaypointWriter))
        by_lidar, come_home = (_named(nodes, name) for name in ("LiDAR branch", "come home"))
        _parent(come_home).remove_child(come_home)
        if options.instead == "land":
            _parent(by_lidar).remove_child(by_lidar)
        else:
            _parent(by_lidar).replace_child(by_lidar, _branch(context, route, options))
        return trees


def _named(nodes: list[Behaviour], name: str) -> Behaviour:
    return next(node for node in nodes if node.name == name)


def _parent(node: Behaviour) -> Composite:
    assert isinstance(node.parent, Composite), f"`{node.name}` is one of several"
    return node.parent


def _branch(context: MissionContext, route: Route, options: MappingOtherwiseOptions) -> Behaviour:
    if options.instead == "home":
        # The way home is watched as on every other flight of this mission.
        return in_order(
            "home at once",
            NoteSwitch("why", context, "navigation", "ZED", "home at once"),
            flown_with(context, LIDAR, "fly home", fly_home(context, options.return_height, options.speed)),
        )
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
        "fly on",
        NoteSwitch("why", context, "navigation", "ZED", "flying blind"),
        RepeatUntil("until the route is done", route.is_done, leg),
        fly_home(context, options.return_height, options.speed),
    )


MISSION = MappingOtherwise()
