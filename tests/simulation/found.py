"""Mistakes that the simulation has found, as the smallest plans that showed them."""

from __future__ import annotations

from collections.abc import Mapping

from simulation.plan import Act, Deed, Plan
from skillwing.services.bus.faulty import Weather


def _goal(number: int, skill: str) -> dict[str, object]:
    return {"goal": f"goal-{number}", "skill": skill}


FOUND: Mapping[str, Plan] = {
    "an interrupt was remembered by a process that died before the start came": Plan(
        3819,
        "streams",
        Weather(latency=(0.0002, 0.2), loss=0.02, duplication=0.05),
        True,
        (
            Act(0.3, "mission", Deed.START, _goal(0, "stream")),
            Act(0.3, "mission", Deed.INTERRUPT, _goal(0, "stream")),
            Act(0.6, "mission", Deed.START, _goal(1, "look")),
            Act(0.601, "mission", Deed.INTERRUPT, _goal(1, "look")),
            Act(0.85, "mission", Deed.INTERRUPT_UNKNOWN, _goal(2, "talk")),
            Act(0.9, "operator", Deed.START, _goal(2, "talk")),
            Act(0.9, "operator", Deed.INTERRUPT, _goal(2, "talk")),
            Act(2.2, "skill/talk", Deed.KILL, {"for": 0.5}),
        ),
    ),
    "a manager's successor told of a goal that had ended well that it had failed": Plan(
        2619,
        "streams",
        Weather(),
        True,
        (
            Act(6.5144, "mission", Deed.START, _goal(0, "look")),
            Act(6.5194, "mission", Deed.INTERRUPT, _goal(0, "look")),
            Act(7.0854, "skill/look", Deed.TWIN, {"for": 0.5}),
            Act(7.5144, "operator", Deed.START_AGAIN, _goal(0, "look")),
        ),
    ),
    "a manager's successor got the grant of the process before it, and ran the goal a second time": Plan(
        14260,
        "streams",
        Weather(latency=(0.0002, 0.02), slow=0.02, slowest=3.0, loss=0.3, duplication=0.3),
        True,
        (
            Act(0.201, "operator", Deed.START, _goal(0, "look")),
            Act(0.38230463, "skill/look", Deed.TWIN, {"for": 0.5}),
        ),
    ),
    "a replaced manager that woke up ended a goal as lost that it was never granted and its successor ran": Plan(
        580,
        "leak",
        Weather(latency=(0.0002, 0.2), slow=0.0, slowest=3.0, loss=0.3, duplication=0.0),
        True,
        (
            Act(3.4370224656250725, "operator", Deed.START, _goal(1, "wash")),
            Act(3.4380224656250724, "operator", Deed.INTERRUPT, _goal(1, "wash")),
            Act(3.6, "operator", Deed.START, _goal(0, "grasp")),
            Act(3.801, "skill/grasp", Deed.TWIN, {"for": 2.5}),
            Act(4.9927835493683945, "robot", Deed.TRIGGER, {"resource": "lid", "target": "JAMMED"}),
            Act(5.301, "mission", Deed.START, _goal(2, "grasp")),
            Act(5.306, "mission", Deed.INTERRUPT, _goal(2, "grasp")),
            Act(6.028041733624765, "robot", Deed.TRIGGER, {"resource": "lid", "target": "OPEN"}),
        ),
    ),
    "a manager woke up beside the last request for a goal, and the goal that its client had given up ran on": Plan(
        7185,
        "exclusive",
        Weather(latency=(0.0002, 0.002), slow=0.0, slowest=3.0),
        True,
        (
            Act(3.9655812110228887, "skill/move", Deed.STOP, {"for": 5.0}),
            Act(5.4030000000000005, "operator", Deed.START, _goal(3, "move") | {"valid": True}),
        ),
    ),
}
