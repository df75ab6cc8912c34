"""The facts about a robot that its policy follows from, out of its table."""

from __future__ import annotations

from collections.abc import Iterable

from skillwing.services.access.policy import RobotAccess
from skillwing.services.names import (
    DATA_MANAGER,
    LAUNCHER,
    MISSION,
    MOCKED_WORLD,
    RESOURCE_MANAGER,
    WEB_VIEWER,
    skill_process,
)
from skillwing.services.options import imported
from skillwing.services.robot import RECORDER, Robot
from skillwing.services.wire.channel import Channel, Role

ALWAYS = {
    RESOURCE_MANAGER: Role.RESOURCE_MANAGER,
    DATA_MANAGER: Role.DATA_MANAGER,
    MOCKED_WORLD: Role.MOCKED_WORLD,
    MISSION: Role.MISSION,
    RECORDER: Role.RECORDER,
    WEB_VIEWER: Role.RECORDER,
    LAUNCHER: Role.LAUNCHER,
}
"""Processes that every robot may have, in addition to a manager for each skill and its functional layer."""


def robot_access(robot: Robot, works_at: Iterable[str] = ()) -> RobotAccess:
    """Processes, roles and topics of a robot. works_at: other robots that its processes work at.

    Raises as `Robot.load_skillset` and its functional layer do.
    """
    skillset = robot.load_skillset()
    layer = {spec.name: Role.FUNCTIONAL_LAYER for spec in robot.functional_layer({})}
    skills = {skill_process(skill.name): Role.SKILL_MANAGER for skill in skillset.skills}
    topics: tuple[Channel, ...] = () if robot.topics is None else imported({"topics": robot.topics}, "topics")
    shared = (MISSION, *robot.shared_processes)
    return RobotAccess(robot.name, skillset.name, {**layer, **skills, **ALWAYS}, topics, shared, tuple(works_at))
