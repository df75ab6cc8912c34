"""A mocked skill manager as a process: what `skillwing up --mock` runs instead of the robot."""

from __future__ import annotations

from typing import Any

from skillwing.dsl import load
from skillwing.services.bus import Node
from skillwing.services.managers.mock import MockHooks, MockScript
from skillwing.services.managers.skill_manager import SkillManagerNode
from skillwing.services.names import DATA_MANAGER, RESOURCE_MANAGER, skill_process
from skillwing.services.options import required
from skillwing.services.robot import ProcessSpec, Robot


def make_mock_manager(options: dict[str, Any]) -> Node:
    """Options: `skillset`, the path of the .skillset file; `skill`, which one to play."""
    skillset = load(required(options, "skillset"))
    return SkillManagerNode(MockHooks(required(options, "skill"), skillset, MockScript()), skillset)


def mock_processes(robot: Robot) -> tuple[ProcessSpec, ...]:
    """The robot's managers, with a mock for every skill of its skillset and nothing below them."""
    real = tuple(spec for spec in robot.managers() if spec.name in (DATA_MANAGER, RESOURCE_MANAGER))
    mocks = tuple(
        ProcessSpec(
            skill_process(skill.name),
            "skillwing.services.processes.mock_host:make_mock_manager",
            {"skillset": str(robot.skillset), "skill": skill.name},
            essential=False,
        )
        for skill in robot.load_skillset().skills
    )
    return real + mocks
