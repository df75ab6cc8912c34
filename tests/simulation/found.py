"""Mistakes that the simulation has found, as the smallest plans that showed them."""

from __future__ import annotations

from collections.abc import Mapping

from faulty_network import NetworkConditions
from simulation.plan import Act, Deed, Plan


def _goal(number: int, skill: str) -> dict[str, object]:
    return {"goal": f"goal-{number}", "skill": skill}


FOUND: Mapping[str, Plan] = {
    "an interrupt was remembered by a process that died before the start came": Plan(
        3819,
        "streams",
        NetworkConditions(latency=(0.0002, 0.2), loss=0.02, duplication=0.05),
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
        NetworkConditions(),
        True,
        (
            Act(6.5144, "mission", Deed.START, _goal(0, "look")),
            Act(6.5194, "mission", Deed.INTERRUPT, _goal(0, "look")),
            Act(7.0854, "skill/look", Deed.TWIN, {"for": 0.5}),
            Act(7.5144, "operator", Deed.START_AGAIN, _goal(0, "look")),
        ),
    ),
    "an interrupt that overtook its start was answered after it, and the client took the goal for lost": Plan(
        2619,
        "streams",
        NetworkConditions(latency=(0.0002, 0.2), slow=0.0, slowest=0.5, loss=0.0, duplication=0.0),
        True,
        (
            Act(5.5096, "robot", Deed.PUBLISH, {"datum": "depth", "value": 3.0}),
            Act(6.5144, "mission", Deed.START, _goal(0, "look") | {"valid": True}),
            Act(6.5194, "mission", Deed.INTERRUPT, _goal(0, "look")),
            Act(7.0854, "skill/look", Deed.TWIN, {"for": 0.5}),
            Act(7.5144, "operator", Deed.START_AGAIN, _goal(0, "look")),
        ),
    ),
    "a manager's successor got the grant of the process before it, and ran the goal a second time": Plan(
        14260,
        "streams",
        NetworkConditions(latency=(0.0002, 0.02), slow=0.02, slowest=3.0, loss=0.3, duplication=0.3),
        True,
        (
            Act(0.201, "operator", Deed.START, _goal(0, "look")),
            Act(0.38230463, "skill/look", Deed.TWIN, {"for": 0.5}),
        ),
    ),
    "a replaced manager that woke up ended a goal as lost that it was never granted and its successor ran": Plan(
        580,
        "leak",
        NetworkConditions(latency=(0.0002, 0.2), slow=0.0, slowest=3.0, loss=0.3, duplication=0.0),
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
        NetworkConditions(latency=(0.0002, 0.002), slow=0.0, slowest=3.0),
        True,
        (
            Act(3.9655812110228887, "skill/move", Deed.STOP, {"for": 5.0}),
            Act(5.4030000000000005, "operator", Deed.START, _goal(3, "move") | {"valid": True}),
        ),
    ),
    "a manager's successor was busy for a goal that had ended well": Plan(
        53653,
        "streams",
        NetworkConditions(),
        True,
        (
            Act(3.5, "operator", Deed.START, _goal(2, "talk")),
            Act(4.0, "skill/talk", Deed.TWIN, {"for": 0.05}),
            Act(4.3, "operator", Deed.START, _goal(4, "talk")),
            Act(4.5, "operator", Deed.START_AGAIN, _goal(2, "talk")),
        ),
    ),
    "a manager's successor told of a goal that was lost that it had never started": Plan(
        57290,
        "exclusive",
        NetworkConditions(latency=(0.0002, 0.02)),
        False,
        (
            Act(5.1, "operator", Deed.START, _goal(1, "move")),
            Act(5.13, "skill/move", Deed.TWIN, {"for": 0.05}),
            Act(5.186, "operator", Deed.INTERRUPT, _goal(1, "move")),
            Act(6.1, "operator", Deed.START_AGAIN, _goal(1, "move")),
        ),
    ),
    "a manager's successor was busy for a goal whose end its predecessor told when it woke up": Plan(
        71049,
        "exclusive",
        NetworkConditions(latency=(0.0002, 0.2)),
        True,
        (
            Act(6.0, "operator", Deed.START, _goal(6, "move")),
            Act(6.1, "mission", Deed.INTERRUPT_AGAIN, _goal(4, "move")),
            Act(6.1, "operator", Deed.INTERRUPT, _goal(6, "move")),
            Act(6.23, "operator", Deed.START, _goal(2, "move")),
            Act(6.3, "skill/move", Deed.TWIN, {"for": 1.2}),
            Act(7.0, "mission", Deed.START_AGAIN, _goal(6, "move")),
        ),
    ),
    "two processes of one name gave the same id to two records in the same millisecond": Plan(
        71608,
        "streams",
        NetworkConditions(),
        False,
        (
            Act(2.1, "robot", Deed.PUBLISH, {"datum": "depth", "value": 3.0}),
            Act(2.6, "robot", Deed.PUBLISH, {"datum": "link", "value": 5.0}),
            Act(3.9, "operator", Deed.START, _goal(2, "talk")),
            Act(4.44, "skill/talk", Deed.TWIN, {"for": 5.0}),
            Act(4.5, "resource_manager", Deed.KILL, {"for": 0.5}),
            Act(5.15, "robot", Deed.PUBLISH, {"datum": "depth", "value": 3.0}),
            Act(5.2, "mission", Deed.START, _goal(5, "talk")),
            Act(5.62, "robot", Deed.PUBLISH, {"datum": "link", "value": 5.0}),
            Act(6.65, "robot", Deed.PUBLISH, {"datum": "link", "value": 0.1}),
            Act(6.8, "robot", Deed.PUBLISH, {"datum": "link", "value": 5.0}),
            Act(7.2, "robot", Deed.PUBLISH, {"datum": "depth", "value": 0.2}),
            Act(7.3, "mission", Deed.START, _goal(0, "look")),
            Act(7.9, "mission", Deed.START, _goal(4, "talk")),
        ),
    ),
    "an interrupt was taken by a process that died, and a start that was on its way reached its successor": Plan(
        72042,
        "streams",
        NetworkConditions(latency=(0.0002, 0.002), loss=0.3, duplication=0.3),
        True,
        (
            Act(0.3, "mission", Deed.START, _goal(0, "stream")),
            Act(0.3, "mission", Deed.START_AGAIN, _goal(0, "stream")),
            Act(0.301, "mission", Deed.INTERRUPT, _goal(0, "stream")),
            Act(0.4, "mission", Deed.INTERRUPT_AGAIN, _goal(0, "stream")),
            Act(0.6, "mission", Deed.START, _goal(1, "look")),
            Act(0.605, "mission", Deed.INTERRUPT, _goal(1, "look")),
            Act(0.8, "mission", Deed.START, _goal(6, "stream")),
            Act(0.801, "mission", Deed.INTERRUPT, _goal(6, "stream")),
            Act(0.9, "mission", Deed.START, _goal(2, "talk")),
            Act(0.9, "mission", Deed.INTERRUPT, _goal(2, "talk")),
            Act(1.4, "robot", Deed.FALL_SILENT, {"datum": "link"}),
            Act(2.13, "skill/stream", Deed.KILL, {"for": 5.0}),
            Act(2.16, "mission", Deed.START, _goal(3, "talk")),
            Act(2.16, "mission", Deed.INTERRUPT, _goal(3, "talk")),
            Act(4.6, "operator", Deed.CUT, {"for": 0.5}),
            Act(6.3, "mission", Deed.INTERRUPT_UNKNOWN, _goal(5, "talk")),
            Act(7.5, "mission", Deed.START, _goal(4, "look")),
            Act(7.6, "mission", Deed.INTERRUPT, _goal(4, "look")),
        ),
    ),
    "a manager woke up and attached for the first time, and its successor's successor had yet to come": Plan(
        77203,
        "chain",
        NetworkConditions(latency=(0.0002, 0.002), slow=0.1, loss=0.3, duplication=0.05),
        True,
        (
            Act(0.2, "operator", Deed.START, _goal(4, "fly")),
            Act(0.3, "operator", Deed.INTERRUPT, _goal(4, "fly")),
            Act(1.7, "robot", Deed.TRIGGER, {"resource": "power", "target": "ON"}),
            Act(2.0, "operator", Deed.START, _goal(1, "sense")),
            Act(2.2, "operator", Deed.INTERRUPT_AGAIN, _goal(4, "fly")),
            Act(3.3, "robot", Deed.TRIGGER, {"resource": "power", "target": "OFF"}),
            Act(4.0, "skill/sense", Deed.TWIN, {"for": 5.0}),
        ),
    ),
    "a manager that was stopped while it validated told of its successor's goal that it was busy": Plan(
        300458,
        "leak",
        NetworkConditions(latency=(0.0002, 0.02), slow=0.1, slowest=3.0, loss=0.02, duplication=0.3),
        True,
        (
            Act(1.4888, "operator", Deed.INTERRUPT_UNKNOWN, _goal(2, "wash")),
            Act(1.5388, "operator", Deed.START, _goal(2, "wash") | {"valid": True}),
            Act(3.252, "operator", Deed.START, _goal(0, "grasp") | {"valid": True}),
            Act(3.3081, "mission", Deed.START, _goal(1, "grasp") | {"valid": False}),
            Act(3.801, "skill/grasp", Deed.TWIN, {"for": 5.0}),
        ),
    ),
}
