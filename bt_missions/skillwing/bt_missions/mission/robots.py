"""Robots of a mission, as far as the mission is built for them and checked against them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from skillwing.bt_missions.mission.mission import Mission
from skillwing.dsl.model import Skillset, UnknownNameError
from skillwing.dsl.suggest import listed
from skillwing.services.errors import InvalidOptionError
from skillwing.services.rescue_goal import RescueGoal


@dataclass(frozen=True, slots=True)
class RobotModel:
    """Skillset and rescue goal of a robot. shared: several missions may use it at once."""

    skillset: Skillset
    rescue_goal: RescueGoal | None = None
    shared: bool = False


def occupied(robots: Mapping[str, RobotModel]) -> tuple[str, ...]:
    """Names of the robots that a mission has for itself: those that are not shared, or else all."""
    return tuple(name for name, model in robots.items() if not model.shared) or tuple(robots)


def names_by_role(mission: Mission, given: Mapping[str, str]) -> dict[str, str]:
    """Name of each robot of a mission on several, by its name in the mission, which is also the default.

    Raises UnknownNameError for a robot that the mission does not have.
    """
    for role in given:
        if role not in mission.robots:
            raise UnknownNameError(f"robot of {mission.name}", role, mission.robots)
    return {role: given.get(role, role) for role in mission.robots}


def require_distinct(names: Mapping[str, str | None]) -> None:
    """Raise InvalidOptionError for a running robot that is given twice. names: by the robots of the mission."""
    chosen = list(names.values())
    if twice := [name for name in chosen if chosen.count(name) > 1]:
        roles = [role for role, name in names.items() if name == twice[0]]
        text = f"Robot `{twice[0]}` cannot be {listed(roles)} of the mission at once. Name another robot for each."
        raise InvalidOptionError("robot", text)


def names_on_board(mission: Mission, given: Mapping[str, str], launcher: str) -> dict[str, str]:
    """The same for a mission that the launcher of the robot `launcher` runs.

    Raises InvalidOptionError if that is none of the robots, and for a robot that is given twice.
    """
    names = names_by_role(mission, given)
    require_distinct(names)
    if launcher not in names.values():
        text = f"Mission `{mission.name}` is for {listed(names.values())}, and `{launcher}` is none of them."
        raise InvalidOptionError("robot", f"{text} The launcher of one of these robots runs it.")
    return names
