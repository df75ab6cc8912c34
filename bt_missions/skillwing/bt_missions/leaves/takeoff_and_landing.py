"""Names by which missions recognise take-off, landing and the state between them in a skillset.

A skillset declares what a skill needs, but not its effect on a state that only the robot changes. By convention of
these missions `takeoff` leads into the air and `land` to the ground, for every robot that has both skills.
"""

from __future__ import annotations

from collections.abc import Mapping

from skillwing.dsl.expressions import names_used
from skillwing.dsl.model import Invariant, Skillset
from skillwing.dsl.queries import holds

TAKEOFF, LAND = "takeoff", "land"
FLIGHT_STATUS, ON_GROUND, IN_AIR = "flight_status", "ON_GROUND", "IN_AIR"


def flies(skillset: Skillset) -> bool:
    """True if the skillset has these skills and states."""
    states = next((each.states for each in skillset.resources if each.name == FLIGHT_STATUS), ())
    return {ON_GROUND, IN_AIR} <= set(states) and {TAKEOFF, LAND} <= {skill.name for skill in skillset.skills}


def holds_landing(skillset: Skillset) -> frozenset[str]:
    """The resources on which a landing depends until its end. While one is in another state, no mission can land."""
    return frozenset[str]().union(*(names_used(each.expression, "resource") for each in _demands(skillset)))


def may_land(skillset: Skillset, states: Mapping[str, str]) -> bool:
    """True if these states allow a landing: for a drone, if the safety pilot does not have it."""
    demands = _demands(skillset)
    known = all(names_used(each.expression, "resource") <= states.keys() for each in demands)
    return known and all(holds(each.expression, states) for each in demands)


def _demands(skillset: Skillset) -> list[Invariant]:
    return [each for each in skillset.skill(LAND).invariants if each.kind == "resource"]
