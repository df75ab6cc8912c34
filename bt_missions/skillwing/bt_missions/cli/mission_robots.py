"""Robots of a mission, as a command line names them: `--robot NAME`, or `--robot left=NAME` for one of several."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Annotated

import typer

from skillwing.bt_missions.checking.mission_check import robots_problem
from skillwing.bt_missions.cli.robot_choice import ChosenRobot, choose_robot
from skillwing.bt_missions.mission.mission import Mission
from skillwing.bt_missions.mission.robots import RobotModel
from skillwing.dsl.model import UnknownNameError
from skillwing.services.errors import InvalidOptionError
from skillwing.services.robot import UnknownRobotError
from skillwing.services.terminal.completion import running
from skillwing.services.terminal.connection import System, connect

RunningRobotsOption = Annotated[
    list[str] | None,
    typer.Option(
        "--robot",
        "-r",
        metavar="[ROBOT=]NAME",
        help="Running robot; `left=NAME` for one of a mission on several, by default the robot of that name.",
        show_default=False,
        autocompletion=running,
    ),
]
RobotTablesOption = Annotated[
    list[str] | None,
    typer.Option(
        "--robot",
        "-r",
        metavar="[ROBOT=]NAME",
        help="Robot: name, or folder of its package; `left=NAME` for one of a mission on several.",
        show_default=False,
    ),
]


def robot_names(mission: Mission, words: Sequence[str]) -> dict[str, str | None]:
    """Name of each robot of a mission: for the only one under an empty name, None for the one that runs.

    Raises InvalidOptionError, and UnknownNameError for a robot that the mission does not have.
    """
    if not mission.robots:
        if len(words) > 1 or any("=" in word for word in words):
            raise InvalidOptionError("robot", robots_problem(mission, ["several"]))
        return {"": next(iter(words), None)}
    found: dict[str, str | None] = {robot: robot for robot in mission.robots}
    for word in words:
        robot, equals, name = word.partition("=")
        if not (equals and name):
            raise InvalidOptionError("robot", robots_problem(mission, []))
        if robot not in found:
            raise UnknownNameError(f"robot of {mission.name}", robot, mission.robots)
        found[robot] = name
    return found


def only_name(words: Sequence[str] | None) -> str | None:
    """The name of the only robot that is named; None for no robot or several."""
    return words[0] if words and len(words) == 1 and "=" not in words[0] else None


@contextmanager
def connected(names: Mapping[str, str | None]) -> Iterator[dict[str, System]]:
    """Connections to these robots, with one thread for all. Raises as `connect` does."""
    with ExitStack() as stack:
        systems: dict[str, System] = {}
        for robot, name in names.items():
            first = next(iter(systems.values()), None)
            systems[robot] = stack.enter_context(connect(name, beside=None if first is None else first.bus))
        yield systems


def models_of(systems: Mapping[str, System]) -> dict[str, RobotModel]:
    """Models of running robots."""
    return {robot: RobotModel(each.skillset, each.target.rescue_goal) for robot, each in systems.items()}


def chosen_robots(mission: Mission, words: Sequence[str], skillset: Path | None) -> dict[str, ChosenRobot]:
    """The robots to check a mission against, running or not. Raises as `robot_names` and `choose_robot` do."""
    names = robot_names(mission, words)
    try:
        return {robot: choose_robot(name, skillset) for robot, name in names.items()}
    except UnknownRobotError as error:
        if error.name in mission.robots:
            raise InvalidOptionError("robot", robots_problem(mission, [])) from error
        raise
