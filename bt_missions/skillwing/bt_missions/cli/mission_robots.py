"""Robots of a mission, as a command line names them: `--robot NAME`, or `--robot left=NAME` for one of several."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from skillwing.bt_missions.checking.mission_check import robots_problem
from skillwing.bt_missions.cli.robot_choice import ChosenRobot, choose_robot
from skillwing.bt_missions.mission.mission import Mission
from skillwing.bt_missions.mission.robots import RobotModel, names_by_role, names_on_board
from skillwing.dsl.suggest import listed
from skillwing.services.errors import InvalidOptionError
from skillwing.services.robot import UnknownRobotError
from skillwing.services.terminal.completion import running
from skillwing.services.terminal.connection import System, connect
from skillwing.services.terminal.robot_option import with_robot

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
    given = _by_role(words)
    if given is None:
        alone = [word for word in words if "=" not in word]
        if len(alone) < len(words):
            text = f"`--robot {alone[0]}` names none of {listed(mission.robots)}."
            text = f"{text} Only with --on-board it names the robot whose launcher runs the mission."
            raise InvalidOptionError("robot", text)
        raise InvalidOptionError("robot", robots_problem(mission, []))
    return {**names_by_role(mission, given)}


def _by_role(words: Iterable[str]) -> dict[str, str] | None:
    """Names of robots by their names in a mission, of words such as `left=NAME`; None if one is no such word."""
    parts = [word.partition("=") for word in words]
    return {role: name for role, _, name in parts} if all(role and name for role, _, name in parts) else None


@dataclass(frozen=True, slots=True)
class RobotsOnBoard:
    """Robots of a mission on board. launcher: name of the robot whose launcher runs it, None for the only one that
    runs. names: the robots of a mission on several, by their names in the mission."""

    launcher: str | None
    names: Mapping[str, str]


def robots_on_board(mission: Mission | None, words: Sequence[str]) -> RobotsOnBoard:
    """Robots of a mission on board. Of several robots, a word without a role names the one whose launcher runs it, by
    default the first one. mission: None for one that is installed on the robot only, which checks the names itself.

    Raises as `robot_names` does, and for a launcher that is none of the robots.
    """
    launchers, roles = [word for word in words if "=" not in word], [word for word in words if "=" in word]
    given = _by_role(roles)
    if given is None or len(launchers) > 1:
        text = "Of several robots name each by `--robot ROBOT=NAME`, and at most one more by `--robot NAME`, to run it."
        raise InvalidOptionError("robot", text)
    launcher = next(iter(launchers), None)
    if mission is None:
        return RobotsOnBoard(launcher or next(iter(given.values()), None), given)
    if not mission.robots:
        return RobotsOnBoard(robot_names(mission, words)[""], {})
    first = launcher or next(iter(names_by_role(mission, given).values()))
    return RobotsOnBoard(first, names_on_board(mission, given, first))


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


def addressed_text(text: str, system: System, names: Mapping[str, str]) -> str:
    """A text of a mission, whose commands in backticks choose the robot that it begins with, else that of `system`.

    names: of the running robots, by their names in the mission.
    """
    name = names.get(text.partition(": ")[0])
    return system.addressed(text) if name is None else with_robot(text, name)


def models_of(systems: Mapping[str, System]) -> dict[str, RobotModel]:
    """Models of running robots."""
    return {
        robot: RobotModel(each.skillset, each.target.rescue_goal, each.target.shared) for robot, each in systems.items()
    }


def chosen_robots(mission: Mission, words: Sequence[str], skillset: Path | None) -> dict[str, ChosenRobot]:
    """The robots to check a mission against, running or not. Raises as `robot_names` and `choose_robot` do."""
    chosen: dict[str, ChosenRobot] = {}
    missing: list[str] = []
    for robot, name in robot_names(mission, words).items():
        try:
            chosen[robot] = choose_robot(name, skillset)
        except UnknownRobotError as error:
            if error.name not in mission.robots:
                raise
            missing.append(robot)
    if missing:
        raise InvalidOptionError("robot", robots_problem(mission, chosen))
    return chosen
