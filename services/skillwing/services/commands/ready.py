"""`skillwing ready`: the readiness of skills, without a start."""

from __future__ import annotations

from typing import Annotated

import typer

from skillwing.services.client.inputs import parse_inputs
from skillwing.services.errors import NoReplyError, RefusedError, SkillwingError
from skillwing.services.names import skill_process
from skillwing.services.protocol import SkillReady
from skillwing.services.terminal import completion
from skillwing.services.terminal.connection import InputsArgument, JsonOption, RobotOption, System, connect
from skillwing.services.terminal.exit_codes import FAILED, OK
from skillwing.services.terminal.output import make_console, print_json, print_table
from skillwing.services.terminal.ready_text import lines, rows
from skillwing.services.terminal.start_advice import ready_advice
from skillwing.services.terminal.system_state import system_state


def ready(
    skill: Annotated[
        str | None,
        typer.Argument(metavar="[SKILL]", help="Skill; all by default.", autocompletion=completion.skills),
    ] = None,
    inputs: InputsArgument = None,
    robot: RobotOption = None,
    as_json: JsonOption = False,
) -> None:
    """Show whether a skill may start, and what is missing. Nothing is started.

    Without SKILL: a table of all skills. Given inputs are checked, too. The `validate` hook of the skill is not called,
    so that a start may still be refused by it.

    Exit codes: 0 ready, or the table is printed; 1 not ready, or no answer; 2 unknown name or malformed value.
    Code 3: no system is running. Code 4: the resource manager refuses to answer now.
    """
    with connect(robot) as system:
        values = parse_inputs(system.skillset.skill(skill), inputs) if skill and inputs else None
        report = system.ask_ready(system.make_interface(), skill or "", values)
        alive = system.alive()
        unmanaged = [each.skill for each in report.skills if skill_process(each.skill) not in alive]
        advice = None if as_json or skill is None else _advice(system, report.skills[0])
    if as_json:
        print_json({"step": report.step, "t": report.t, "skills": report.skills, "without_manager": unmanaged})
    elif skill is None:
        print_table(make_console(), ("SKILL", "READY", "WHY"), rows(report.skills, unmanaged))
    else:
        console = make_console()
        for line in lines(report.skills[0], advice):
            console.print(line, markup=False)
    if skill is None:
        raise typer.Exit(OK)
    if unmanaged:
        raise SkillwingError(f"No manager of `{skill}` runs. See with `skillwing status` which do.")
    raise typer.Exit(OK if report.skills[0].ready else FAILED)


def _advice(system: System, skill: SkillReady) -> list[str] | None:
    """Ways to make the skill ready; None without the states of the resources."""
    if skill.ready:
        return []
    try:
        return list(ready_advice(system.skillset, skill, system_state(system)))
    except (NoReplyError, RefusedError):
        return None
