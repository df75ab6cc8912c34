"""Robot that a command of missions is about: the one that is named, or that runs, or the default one."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from skillwing.bt_missions.tree_skill.called import skills_folder
from skillwing.dsl import load
from skillwing.dsl.model import Skillset
from skillwing.services.client.connection import DEFAULT_ROBOT, running_system
from skillwing.services.rescue_goal import RescueGoal
from skillwing.services.robot import find_robot


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

    Without a name it is the one that runs, else that of SKILLWING_ROBOT, else the default one. Raises
    SeveralSystemsError, and as `find_robot` and `load` do.
    """
    if skillset is not None:
        return ChosenRobot(load(skillset), None, skills_folder=skills_folder(skillset))
    if (state := running_system(name)) is not None:
        file = Path(state.skillset)
        return ChosenRobot(load(file), state.rescue_goal, state.mission_templates, skills_folder=skills_folder(file))
    known = name or os.environ.get("SKILLWING_ROBOT")
    table = find_robot(known or DEFAULT_ROBOT)
    chosen = known is not None
    folder = skills_folder(table.skillset)
    return ChosenRobot(table.load_skillset(), table.rescue_goal, table.mission_templates, chosen, folder)
