"""`skillwing interrupt`: interruption of a goal."""

from __future__ import annotations

from typing import Annotated

import typer

from skillwing.services.bus import RunnableBus
from skillwing.services.client.interface import GoalHandle
from skillwing.services.errors import SkillwingError
from skillwing.services.protocol import Ending
from skillwing.services.terminal.completion import skills
from skillwing.services.terminal.connection import JsonOption, RobotOption, connect
from skillwing.services.terminal.exit_codes import FAILED, OK
from skillwing.services.terminal.find_goal import find_goal
from skillwing.services.terminal.output import end_text, make_console, print_json

MARGIN = 5.0
"""Seconds of robot time after the skill's interrupt timeout until the manager counts as silent."""


def interrupt(
    which: Annotated[
        str,
        typer.Argument(metavar="SKILL|GOAL", help="Skill, or id of a goal.", show_default=False, autocompletion=skills),
    ],
    robot: RobotOption = None,
    as_json: JsonOption = False,
) -> None:
    """Interrupt a skill's running goal, or a goal by its id, and wait for its end.

    Exit codes: 0 the goal has been interrupted, 1 it ended otherwise or nothing was running, 2 unknown name.
    """
    with connect(robot) as system:
        status = find_goal(system, which)
        interface = system.make_interface()
        goal = interface.follow(status.skill, status.goal_id)
        interface.interrupt(goal)
        patience = system.skillset.skill(status.skill).interrupt.timeout + MARGIN
        wait_for_end(system.bus, goal, patience)
    if goal.terminal is None:
        raise SkillwingError(f"{goal.skill} has not ended in {patience:g} s. Look at `skillwing status`.")
    if as_json:
        print_json({"goal_id": goal.goal_id, "skill": goal.skill, "state": goal.state, "terminal": goal.terminal})
    else:
        make_console().print(end_text(goal.terminal))
    raise typer.Exit(OK if goal.terminal.ending is Ending.INTERRUPTED else FAILED)


def wait_for_end(bus: RunnableBus, goal: GoalHandle, patience: float) -> None:
    """Wait until a goal has ended, or `patience` seconds of robot time have passed, or robot time stands still for as
    long in wall time."""
    deadline = bus.now() + patience
    while not goal.done and (before := bus.now()) < deadline:
        bus.run_until(lambda: goal.done or bus.now() >= deadline, patience)
        if bus.now() == before:
            return
