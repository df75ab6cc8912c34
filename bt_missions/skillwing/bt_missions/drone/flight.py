"""Subtrees that all missions of a drone share: guards, take-off, pause, way home, landing and rescue."""

from __future__ import annotations

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.composites import Sequence
from py_trees.decorators import Retry, SuccessIsFailure

from skillwing.bt_missions.leaves.branch_switch import NoteSwitch, WaitForSettled
from skillwing.bt_missions.leaves.conditions import ResourceIs
from skillwing.bt_missions.leaves.context import MissionContext
from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.bt_missions.planning.waypoints import PointAbove
from skillwing.bt_missions.subtrees.composites import OnEnding, first_that_works, guarded, in_order
from skillwing.bt_missions.subtrees.decorators import Deadline
from skillwing.bt_missions.subtrees.pausing import Pausable, StateChange, WhileGranted

TAKEOFF, LAND = "takeoff", "land"
FLIGHT_STATUS, ON_GROUND, IN_AIR = "flight_status", "ON_GROUND", "IN_AIR"
LANDED = {"S_LANDED": Status.SUCCESS, "S_BLOCKED": Status.FAILURE}
STOPPING_PATIENCE = 10.0
"""Longest wait for cancelled motions before a landing, in seconds of robot time."""
ATTEMPTS = 3


def landed(context: MissionContext) -> OnEnding:
    """Landing. A drone that stands already cannot land (`NR`), and counts as landed.

    The safety pilot may take the drone at the moment of touchdown, and give it back on the ground.
    """
    return OnEnding(
        "landed",
        SkillAction("land", context, LAND, outcomes=LANDED),
        ("NR",),
        ResourceIs("on the ground?", context, FLIGHT_STATUS, ON_GROUND),
    )


def land_where_it_is(context: MissionContext) -> Sequence:
    """Wait until the drone has stopped, then land it if it flies. SUCCESS: it is on the ground."""
    land: Behaviour = landed(context)
    return in_order(
        "land where it is",
        WaitForSettled("stopped", context, STOPPING_PATIENCE),
        first_that_works(
            "on the ground",
            ResourceIs("on the ground?", context, FLIGHT_STATUS, ON_GROUND, question=True),
            Retry(f"at most {ATTEMPTS} times", land, num_failures=ATTEMPTS),
        ),
    )


PILOT_PATIENCE = 120.0
"""Longest time for which the safety pilot may have the drone before the mission ends, in seconds of robot time."""
LONGEST_HOVER = 3600.0
"""Duration of one hover during a pause, in seconds of robot time. The next one follows."""
TAKEN_OFF = {"S_AT_ALTITUDE": Status.SUCCESS, "S_BLOCKED": Status.FAILURE, "S_ABORTED": Status.FAILURE}
CLIMBED = {"S_ARRIVED": Status.SUCCESS, "S_BLOCKED": Status.FAILURE, "S_ABORTED": Status.FAILURE}
AT_HOME = {"S_ARRIVED": Status.SUCCESS, "S_ABORTED": Status.FAILURE}


def guarded_flight(
    context: MissionContext, flight: Behaviour, verdict: Behaviour, *, time_limit: float, pilot_patience: float
) -> WhileGranted:
    """`flight` and a landing, below the guards of all missions: safety pilot, battery, time limit.

    If the flight fails, the drone lands where it is. While the pilot has it, no motion is commanded, also no landing.
    verdict: SUCCESS if the mission was done, ticked after the landing. time_limit: in seconds of robot time.
    """
    charged = ResourceIs("battery?", context, "battery_status", "NORMAL", "LOW")
    in_good_time = Deadline("in good time", context, time_limit, flight)
    failed = in_order(
        "flight failed",
        NoteSwitch("why", context, "mission", "flight", "landing where it is"),
        land_where_it_is(context),
    )
    return unless_the_pilot_flies(
        context,
        pilot_patience,
        in_order(
            "fly, then verify",
            first_that_works(
                "fly or land",
                in_order("fly and land", guarded("while the battery lasts", charged, in_good_time), landed(context)),
                SuccessIsFailure("landed, but not done", failed),
            ),
            verdict,
        ),
    )


def take_off(context: MissionContext, height: float) -> Behaviour:
    """Climb to `height`. A take-off that was held in the air cannot start again; a straight climb replaces it."""
    above = PointAbove("straight up", context, height)
    return OnEnding(
        "up",
        SkillAction("takeoff", context, TAKEOFF, {"height": height}, outcomes=TAKEN_OFF),
        ("NR",),
        in_order(
            "climb on",
            ResourceIs("in the air?", context, FLIGHT_STATUS, IN_AIR),
            above,
            SkillAction("climb", context, "goto", {"target": above.target}, outcomes=CLIMBED),
        ),
    )


def fly_home(context: MissionContext, height: float, speed: float) -> SkillAction:
    """Flight home over all obstacles, without a landing. height: at the start, in metres. speed: in m/s."""
    return SkillAction("return_home", context, "return_home", {"height": height, "speed": speed}, outcomes=AT_HOME)


def or_pause(context: MissionContext, flight: Behaviour) -> Pausable:
    """`flight`, which the operator may pause while the battery is NORMAL. The drone hovers meanwhile."""
    return Pausable(
        "the flight",
        context,
        ResourceIs("charged enough to wait?", context, "battery_status", "NORMAL"),
        in_order(
            "hold the place",
            ResourceIs("in the air?", context, FLIGHT_STATUS, IN_AIR, question=True),
            SkillAction("hover", context, "hover", {"duration": LONGEST_HOVER}),
        ),
        flight,
    )


def unless_the_pilot_flies(context: MissionContext, patience: float, mission: Behaviour) -> WhileGranted:
    """`mission`, held while the safety pilot has the drone. It ends if the pilot keeps the drone, or lands it."""
    return WhileGranted(
        "unless the pilot flies",
        context,
        mission,
        resource="SDK_authority",
        states=("AVAILABLE",),
        patience=patience,
        ended_by=StateChange(FLIGHT_STATUS, ON_GROUND),
    )


def rescue(context: MissionContext) -> Behaviour:
    """Landing after an abort or an exception in a leaf, unless the safety pilot has the drone."""
    may_fly = ResourceIs("may we fly?", context, "SDK_authority", "AVAILABLE")
    return guarded("rescue", may_fly, land_where_it_is(context))
