"""The facts about a robot that its policy follows from, out of its table."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

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
from skillwing.services.robot import RECORDER, TABLE, Robot, find_robot, robot_names
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


def table_words(robot: Robot) -> str:
    """Words by which `keys add-robot` finds the table of a robot: `m600`, a folder, or a skillset with its option.

    Imports installed robots, as far as it must.
    """
    for name in robot_names():
        with suppress(Exception):  # the table of another robot may be damaged in any way
            if find_robot(name).skillset == robot.skillset:
                return name
    folder = robot.skillset.parent
    here = Path.cwd()
    place = folder.relative_to(here) if folder.is_relative_to(here) else folder
    if (folder / TABLE).is_file():
        return f"./{place}" if place is not folder else f"{place}"
    return f"{robot.name} --skillset {place / robot.skillset.name}"


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
