"""Processes and robots with mocks: real managers, mocked skills, and a mocked world below them."""

from __future__ import annotations

import os
import signal
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import msgspec

from skillwing.dsl import load
from skillwing.dsl.model import Skillset
from skillwing.dsl.naming import script_of
from skillwing.services.bus import Node
from skillwing.services.mocking.fitting import fit_script
from skillwing.services.mocking.script import MockScript
from skillwing.services.mocking.script_file import load_scripts
from skillwing.services.mocking.skill import MockSkillNode
from skillwing.services.mocking.world import MockWorld
from skillwing.services.names import DATA_MANAGER, MOCKED_WORLD, RESOURCE_MANAGER, skill_process
from skillwing.services.options import required
from skillwing.services.robot import ProcessSpec, Robot

FACTORIES = "skillwing.services.mocking.system"


def scripts_for(skillset: Path, given: Path | None = None) -> tuple[Path, ...]:
    """The scripts of a skillset file: `m600.mock.toml` beside `m600.skillset`, if it exists, and the given one.

    A given script adds to the one beside the file.
    """
    beside = script_of(skillset)
    found = (beside,) if beside.is_file() else ()
    return found if given is None else (*found, given)


# --- in one process --------------------------------------------------------------------------------------------------


def make_mock_skill(skillset: Skillset, skill: str, script: MockScript | None = None) -> MockSkillNode:
    """The mocked manager of one skill. Raises ScriptError, and UnknownNameError for an unknown skill."""
    skillset.skill(skill)
    return MockSkillNode(skillset, skill, fit_script(script or MockScript(), skillset))


def make_mock_managers(skillset: Skillset, script: MockScript | None = None) -> list[Node]:
    """The data manager, the resource manager, and a mock of each skill's manager. Raises ScriptError."""
    # The process of one mock does not load the other managers, a third of its start.
    from skillwing.services.managers.data_manager import DataManagerNode  # noqa: PLC0415
    from skillwing.services.managers.resource_manager import ResourceManagerNode  # noqa: PLC0415

    fitted = fit_script(script or MockScript(), skillset)
    mocks = [MockSkillNode(skillset, skill.name, fitted) for skill in skillset.skills]
    return [DataManagerNode(skillset), ResourceManagerNode(skillset), *mocks]


# --- as processes ----------------------------------------------------------------------------------------------------


def mock_processes(
    robot: Robot,
    *,
    scripts: Sequence[Path] = (),
    seed: int | None = None,
    skills: Collection[str] | None = None,
    world: bool = False,
    run: Mapping[str, Any] = MappingProxyType({}),
) -> tuple[ProcessSpec, ...]:
    """The processes of a robot with mocks: for all its skills and the world, or only for the given skills.

    With `skills`, other skills keep their managers. Then the caller adds the processes below, or asks for a mocked
    `world`. scripts: files that add to one another; seed: replaces the one in them; run: options of the run.
    """
    options: dict[str, Any] = {"skillset": str(robot.skillset), "scripts": [str(each.absolute()) for each in scripts]}
    options |= {} if seed is None else {"seed": seed}
    managers = {spec.name: spec for spec in robot.managers(run)}
    names = [skill.name for skill in robot.load_skillset().skills] if skills is None else list(skills)
    mocks = {
        skill_process(name): ProcessSpec(
            skill_process(name), f"{FACTORIES}:make_mock_skill_process", {**options, "skill": name}, essential=False
        )
        for name in names
    }
    below = ProcessSpec(MOCKED_WORLD, f"{FACTORIES}:make_mock_world_process", options, essential=False)
    if skills is not None:
        return (*(managers | mocks).values(), *((below,) if world else ()))
    return (managers[DATA_MANAGER], managers[RESOURCE_MANAGER], *mocks.values(), below)


def make_mock_skill_process(options: dict[str, Any]) -> Node:
    """Options: `skillset`, the path of the skillset file; `skill`, the mocked one; `scripts`, `seed` (optional)."""
    skillset, script = _skillset_and_script(options)
    return MockSkillNode(skillset, required(options, "skill"), fit_script(script, skillset), crash=_kill_this_process)


def make_mock_world_process(options: dict[str, Any]) -> Node:
    """Options: `skillset`, the path of the skillset file; `scripts` and `seed`, both optional."""
    return MockWorld(*_skillset_and_script(options))


def _skillset_and_script(options: dict[str, Any]) -> tuple[Skillset, MockScript]:
    skillset = load(required(options, "skillset"))
    script = load_scripts(options.get("scripts", ()), skillset)
    seed = options.get("seed")
    return skillset, script if seed is None else msgspec.structs.replace(script, seed=int(seed))


def _kill_this_process() -> None:
    os.kill(os.getpid(), signal.SIGKILL)


# --- as a robot of its own ------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class MockedRobot(Robot):
    """A robot with the managers of another one, mocked skills, and a mocked world."""

    def managers(self, run: Mapping[str, Any] = MappingProxyType({})) -> tuple[ProcessSpec, ...]:
        """Processes as of `mock_processes`, with the script beside the skillset and the seed of the run."""
        return mock_processes(without_layer(self), scripts=scripts_for(self.skillset), seed=run.get("seed"), run=run)


def mocked(robot: Robot) -> MockedRobot:
    """A mocked copy of a robot, named after it, such as `m600-mocks`. Its clock is wall time."""
    return MockedRobot(**vars(replace(without_layer(robot), name=f"{robot.name}-mocks")))


def without_layer(robot: Robot) -> Robot:
    """A robot on mocks alone, in wall time: without functional layer, site and judge, with what its missions need."""
    return Robot(
        robot.name,
        robot.skillset,
        robot.hooks,
        clock="wall",
        rescue_goal=robot.rescue_goal,
        mission_templates=robot.mission_templates,
    )
