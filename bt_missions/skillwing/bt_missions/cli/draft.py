"""File of a new mission: the draft that the robot's table brings, or else one from its skillset."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

from skillwing.bt_missions.cli.robot_choice import ChosenRobot
from skillwing.bt_missions.drafting.mission_files import draft_python_file, draft_tree_file
from skillwing.bt_missions.xml.tree_file import RESCUE
from skillwing.dsl.whole_files import write_whole
from skillwing.services.errors import InvalidOptionError

TEMPLATES = {".xml": "template.xml", ".py": "template.py.txt"}
"""Template of a mission by suffix. The one in Python has the suffix .txt, as it is not a module of its package."""
DRAFTS = {".xml": draft_tree_file, ".py": draft_python_file}


def write_draft(file: Path, robot: ChosenRobot) -> None:
    """Write a mission with the name of the file.

    Raises InvalidOptionError if the file exists already, or cannot be one of a mission by its name. So it does for a
    robot with a wrong rescue goal.
    """
    if file.suffix not in DRAFTS:
        raise InvalidOptionError("FILE", f"`{file}` ends neither with .xml nor with .py. Name it {file.stem}.xml.")
    if not file.stem.isidentifier() or file.stem == RESCUE:
        text = f"`{file.stem}` cannot name a mission. Write a letter, then letters, digits or `_`, but not `{RESCUE}`."
        raise InvalidOptionError("FILE", text)
    if robot.rescue_goal is not None:
        robot.rescue_goal.require_fit(robot.skillset)
    if file.exists():
        raise InvalidOptionError("FILE", f"There is `{file}` already. Choose another name.")
    write_whole(file, draft_text(file, robot))


def draft_text(file: Path, robot: ChosenRobot) -> str:
    """The content of a new mission with the name of this file."""
    if robot.templates is None:
        return DRAFTS[file.suffix](file.stem, robot.skillset, robot.rescue_goal)
    template = files(robot.templates).joinpath(TEMPLATES[file.suffix]).read_text(encoding="utf-8")
    return template.replace("NAME", file.stem)
