"""What missions are told of the place where the running robot is."""

from __future__ import annotations

import os
from typing import Any

from skillwing.services.client.connection import DEFAULT_ROBOT, Target
from skillwing.services.processes.run_options import run_options
from skillwing.services.processes.run_state import read_run_state
from skillwing.services.robot import find_robot


def briefing(target: Target, mission: str) -> dict[str, Any]:
    """Options of the mission, as far as they follow from the place; none where nothing is known of it.

    Of a system that runs here `up` has left them. Of another one, such as containers, the same environment tells as
    tells its processes. Raises InvalidOptionError for a place that there is not, and as `find_robot` does.
    """
    if target.pid is not None:
        state = read_run_state(target.robot)
        known = {} if state is None else state.briefing
    else:
        robot = find_robot(os.environ.get("SKILLWING_ROBOT") or DEFAULT_ROBOT)
        known = robot.brief(run_options(os.environ))
    return known.get(mission, {})
