"""What every mission of a drone shares: taking off, standing still for the operator, giving way to the safety pilot."""

from __future__ import annotations

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from skillwing.bt_missions.leaves.conditions import ResourceIs
from skillwing.bt_missions.leaves.context import MissionContext
from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.bt_missions.planning.waypoints import PointAbove
from skillwing.bt_missions.subtrees.composites import OnEnding, guarded, in_order
from skillwing.bt_missions.subtrees.holding import Change, Pausable, WhileGranted
from skillwing.bt_missions.subtrees.landing import land_where_it_is

PILOT_PATIENCE = 120.0
"""Robot seconds for which the safety pilot may have the drone before the mission ends."""
LONGEST_HOVER = 3600.0
"""Robot seconds; after that the next one begins."""
TAKEN_OFF = {"S_AT_ALTITUDE": Status.SUCCESS, "S_BLOCKED": Status.FAILURE, "S_ABORTED": Status.FAILURE}
CLIMBED = {"S_ARRIVED": Status.SUCCESS, "S_BLOCKED": Status.FAILURE, "S_ABORTED": Status.FAILURE}


def take_off(context: MissionContext, height: float) -> Behaviour:
    """Climb to `height`. A take-off that was held in the air is refused when it begins again: then climb on."""
    above = PointAbove("straight up", context, height)
    return OnEnding(
        "up",
        SkillAction("takeoff", context, "takeoff", {"height": height}, outcomes=TAKEN_OFF),
        ("NR",),
        in_order(
            "climb on",
            ResourceIs("in the air?", context, "flight_status", "IN_AIR"),
            above,
            SkillAction("climb", context, "goto", {"target": above.target}, outcomes=CLIMBED),
        ),
    )


def or_pause(context: MissionContext, flight: Behaviour) -> Pausable:
    """`flight`, which the operator may pause as long as the battery is good: the drone then hovers."""
    return Pausable(
        "the flight",
        context,
        ResourceIs("charged enough to wait?", context, "battery_status", "NORMAL"),
        in_order(
            "hold the place",
            ResourceIs("in the air?", context, "flight_status", "IN_AIR", question=True),
            SkillAction("hover", context, "hover", {"duration": LONGEST_HOVER}),
        ),
        flight,
    )


def unless_the_pilot_flies(context: MissionContext, patience: float, mission: Behaviour) -> WhileGranted:
    """`mission`, held while the safety pilot has the drone. It ends when he keeps it, or has landed it."""
    return WhileGranted(
        "unless the pilot flies",
        context,
        mission,
        resource="SDK_authority",
        states=("AVAILABLE",),
        patience=patience,
        ended_by=Change("flight_status", "ON_GROUND"),
    )


def rescue(context: MissionContext) -> Behaviour:
    """What to do when somebody aborts the mission, or a leaf raises: land, unless the safety pilot has the drone."""
    may_fly = ResourceIs("may we fly?", context, "SDK_authority", "AVAILABLE")
    return guarded("rescue", may_fly, land_where_it_is(context))
