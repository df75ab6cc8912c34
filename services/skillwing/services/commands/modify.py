"""`skillwing modify`: new inputs for a running goal."""

from __future__ import annotations

from typing import Annotated

import typer

from skillwing.services.bus import Answer
from skillwing.services.client.inputs import parse_inputs
from skillwing.services.client.retry import accepted
from skillwing.services.errors import InvalidOptionError
from skillwing.services.protocol import GoalStatus, decode
from skillwing.services.terminal.completion import skills
from skillwing.services.terminal.connection import InputsArgument, JsonOption, RobotOption, connect
from skillwing.services.terminal.find_goal import find_goal
from skillwing.services.terminal.output import make_console, print_json


def modify(
    which: Annotated[
        str,
        typer.Argument(metavar="SKILL|GOAL", help="Skill, or id of a goal.", show_default=False, autocompletion=skills),
    ],
    inputs: InputsArgument = None,
    robot: RobotOption = None,
    as_json: JsonOption = False,
) -> None:
    """Give a skill's running goal new values for modifiable inputs; the others stay. All are taken, or none.

    Exit codes: 0 they are taken, 1 nothing is running or no answer, 2 unknown name or malformed value.
    Code 3: no system is running. Code 4: the skill's manager refused; the goal keeps its inputs.
    """
    if not inputs:
        raise InvalidOptionError("inputs", "No input is named. Add one, as `NAME=VALUE`.")
    with connect(robot) as system:
        found = find_goal(system, which)
        values = parse_inputs(system.skillset.skill(found.skill), inputs, partial=True)
        interface = system.make_interface()
        goal = interface.follow(found.skill, found.goal_id)
        answers: list[Answer] = []
        interface.modify(goal, values, answers.append)
        system.bus.run_until(lambda: bool(answers))
        status = decode(accepted(answers[0], system.keys.modify(found.skill)).payload, GoalStatus)
    if as_json:
        print_json({"goal_id": status.goal_id, "skill": status.skill, "revision": status.revision})
    else:
        make_console().print(f"{status.skill} goes on as goal {status.goal_id}, modification {status.revision}.")
