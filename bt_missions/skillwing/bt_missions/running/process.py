"""The process of a mission, for launchers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import msgspec

from skillwing.services.names import MISSION
from skillwing.services.robot import ProcessSpec, Robot


def mission_process(robot: Robot, mission: str, options: Mapping[str, Any]) -> ProcessSpec:
    """The process that runs a mission, by its name or file, on a robot.

    It is not restarted: a mission would begin again with a robot that is somewhere else.
    """
    given = {
        "mission": mission,
        "skillset": str(robot.skillset),
        "rescue_goal": msgspec.to_builtins(robot.rescue_goal),
        **options,
    }
    factory = "skillwing.bt_missions.running.runner:make_mission"
    return ProcessSpec(MISSION, factory, given, extra="missions", restart="never")
