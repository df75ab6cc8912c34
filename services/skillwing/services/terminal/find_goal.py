"""The goal that a command's argument names."""

from __future__ import annotations

from skillwing.dsl import UnknownNameError
from skillwing.services.errors import NoGoalError
from skillwing.services.protocol import GoalStatus, State
from skillwing.services.terminal.connection import System


def find_goal(system: System, which: str) -> GoalStatus:
    """The running goal of a skill, or the goal of that id. Raises UnknownNameError or NoGoalError."""
    skills = [skill.name for skill in system.skillset.skills]
    if which in skills:
        status = system.goal(which)
        if status is None or status.state is State.TERMINATED:
            raise NoGoalError(which)
        return status
    for skill in skills:
        status = system.goal(skill, which)
        if status is not None:
            return status
    raise UnknownNameError("skill or goal", which, skills)
