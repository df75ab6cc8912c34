"""Coming down where the drone is, whatever happened before."""

from __future__ import annotations

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.composites import Sequence
from py_trees.decorators import Retry

from skillwing.bt_missions.leaves.branch_switch import Settled
from skillwing.bt_missions.leaves.conditions import ResourceIs
from skillwing.bt_missions.leaves.context import MissionContext
from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.bt_missions.leaves.takeoff_and_landing import FLIGHT_STATUS, LAND, ON_GROUND
from skillwing.bt_missions.subtrees.composites import first_that_works, in_order

LANDED = {"S_LANDED": Status.SUCCESS, "S_BLOCKED": Status.FAILURE}
STOPPING_PATIENCE = 10.0
"""How long to wait for cancelled motions before coming down, in seconds of robot time."""
ATTEMPTS = 3


def land_where_it_is(context: MissionContext) -> Sequence:
    """Wait until the drone has stopped, then land it if it flies. SUCCESS: it is on the ground."""
    land: Behaviour = SkillAction("land", context, LAND, outcomes=LANDED)
    return in_order(
        "land where it is",
        Settled("stopped", context, STOPPING_PATIENCE),
        first_that_works(
            "on the ground",
            ResourceIs("on the ground?", context, FLIGHT_STATUS, ON_GROUND, question=True),
            Retry(f"at most {ATTEMPTS} times", land, num_failures=ATTEMPTS),
        ),
    )
