"""The node of a mission on board, in a process of the robot's launcher."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import msgspec

from skillwing.bt_missions.checking.mission_check import require_fit, robots_problem
from skillwing.bt_missions.library import find_mission
from skillwing.bt_missions.mission.mission import Mission
from skillwing.bt_missions.mission.robots import RobotModel, names_on_board
from skillwing.bt_missions.running.on_robots import MissionOnRobots
from skillwing.bt_missions.running.runner import MissionNode
from skillwing.dsl import load
from skillwing.services.errors import InvalidOptionError
from skillwing.services.options import required
from skillwing.services.rescue_goal import RescueGoal


def make_mission_on_board(options: dict[str, Any]) -> MissionNode | MissionOnRobots:
    """A node that runs one mission, and ends its process after that.

    options: "mission" is a name or a tree file, "skillset" the path of the file. "rescue_goal" is the robot's, as a
    mapping. "options" are the mission's, and "sites" those by the site, by mission. "robot" is the name of this robot,
    and "robots" are those of a mission on several, by their names in the mission. "request_id" is that of the request.
    Raises UnknownNameError, InvalidOptionError, SkillsetError, and FaultyMissionError for a mission that does not fit
    the robot.
    """
    mission = find_mission(required(options, "mission"))
    robots = options.get("robots", {})
    if mission.robots:
        return _on_robots(mission, robots, options)
    if robots:
        raise InvalidOptionError("robot", robots_problem(mission, robots))
    skillset = load(Path(required(options, "skillset")))
    site = options.get("sites", {}).get(mission.name, {})
    known = {name: value for name, value in site.items() if name in mission.option_names}
    given = mission.read_options(known | options.get("options", {}))
    goal = msgspec.convert(options.get("rescue_goal"), RescueGoal | None)
    require_fit(mission, {"": RobotModel(skillset, goal)}, given)
    return MissionNode(
        mission, skillset, given, rescue_goal=goal, ends_process=True, request_id=options.get("request_id", "")
    )


def _on_robots(mission: Mission, robots: dict[str, str], options: dict[str, Any]) -> MissionOnRobots:
    own = required(options, "robot")
    names = names_on_board(mission, robots, own)
    given = mission.read_options(options.get("options", {}))
    return MissionOnRobots(mission, names, own, given, options.get("request_id", ""))
