"""Robot that a command of missions is about: the one that is named, or that runs, or the default one."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from skillwing.bt_missions.tree_skill.called import skills_folder
from skillwing.dsl import load
from skillwing.dsl.model import Skillset
from skillwing.services.client.connection import running_system
from skillwing.services.client.target import CONNECT, DEFAULT_ROBOT, find_target_at
from skillwing.services.errors import NoSystemError
from skillwing.services.processes.run_state import running_systems
from skillwing.services.rescue_goal import RescueGoal
from skillwing.services.robot import Robot, UnknownRobotError, find_robot


@dataclass(frozen=True)
class ChosenRobot:
    """A robot, as far as missions are checked against it.

    templates: package with templates of missions, None for none. is_chosen: the robot was named, or it runs.
    skills_folder: of its managers and trees; None if it is not known.
    """

    skillset: Skillset
    rescue_goal: RescueGoal | None
    templates: str | None = None
    is_chosen: bool = True
    skills_folder: Path | None = None


def choose_robot(name: str | None, skillset: Path | None = None) -> ChosenRobot:
    """The robot of that name, running or installed, or of that package folder. skillset: its file alone, instead.

    Without a name it is the one that runs, else that of SKILLWING_ROBOT, else the default one. At SKILLWING_CONNECT the
    robot of that name tells its skillset. Raises SeveralSystemsError, and as `find_robot` and `load` do.
    """
    if skillset is not None:
        return ChosenRobot(load(skillset), None, skills_folder=skills_folder(skillset))
    if name is not None and (endpoint := os.environ.get(CONNECT)):
        return _robot_at(endpoint, name)
    if (state := running_system(name)) is not None:
        file = Path(state.skillset)
        return ChosenRobot(load(file), state.rescue_goal, state.mission_templates, skills_folder=skills_folder(file))
    known = name or os.environ.get("SKILLWING_ROBOT")
    table = _installed(known or DEFAULT_ROBOT)
    chosen = known is not None
    folder = skills_folder(table.skillset)
    return ChosenRobot(table.load_skillset(), table.rescue_goal, table.mission_templates, chosen, folder)


def _installed(name: str) -> Robot:
    """The table of that name. Raises as `find_robot`, with the robots that run here among the possible names."""
    try:
        return find_robot(name)
    except UnknownRobotError as error:
        raise UnknownRobotError(name, [state.robot for state in running_systems()]) from error


def _robot_at(endpoint: str, name: str) -> ChosenRobot:
    """The robot of that name at an endpoint; if there is none, an installed one."""
    try:
        target = find_target_at(endpoint, name)
    except NoSystemError:
        table = find_robot(name)
        folder = skills_folder(table.skillset)
        return ChosenRobot(table.load_skillset(), table.rescue_goal, table.mission_templates, skills_folder=folder)
    templates = None if target.table is None else find_robot(target.table).mission_templates
    folder = None if target.table is None else skills_folder(target.skillset)
    return ChosenRobot(load(target.skillset), target.rescue_goal, templates, skills_folder=folder)
