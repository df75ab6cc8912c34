"""The words in which skillsets of drones speak of the ground and the air.

A skillset says what a skill needs, and not what it does to a state that only the robot can change. That a take-off
leads into the air and a landing to the ground is a convention of the missions here, for every robot that has these.
"""

from __future__ import annotations

from collections.abc import Mapping

from skillwing.dsl.expressions import Environment, evaluate, names_used
from skillwing.dsl.model import Invariant, Skillset

TAKEOFF, LAND = "takeoff", "land"
FLIGHT_STATUS, ON_GROUND, IN_AIR = "flight_status", "ON_GROUND", "IN_AIR"


def flies(skillset: Skillset) -> bool:
    """Whether this robot takes off and lands in these words."""
    states = next((each.states for each in skillset.resources if each.name == FLIGHT_STATUS), ())
    return {ON_GROUND, IN_AIR} <= set(states) and {TAKEOFF, LAND} <= {skill.name for skill in skillset.skills}


def holds_landing(skillset: Skillset) -> frozenset[str]:
    """The resources on which a landing depends until its end: while these are not right, nobody here can land it."""
    return frozenset[str]().union(*(names_used(each.expression, "resource") for each in _demands(skillset)))


def may_land(skillset: Skillset, states: Mapping[str, str]) -> bool:
    """Whether nothing that a landing depends on speaks against one: for a drone, that no safety pilot has it."""
    demands = _demands(skillset)
    known = all(names_used(each.expression, "resource") <= states.keys() for each in demands)
    return known and all(evaluate(each.expression, Environment(resources=states)) for each in demands)


def _demands(skillset: Skillset) -> list[Invariant]:
    return [each for each in skillset.skill(LAND).invariants if each.kind == "resource"]
