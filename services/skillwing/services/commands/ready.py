"""`skillwing ready`: the readiness of skills, without a start."""

from __future__ import annotations

from typing import Annotated

import typer

from skillwing.services.client.inputs import parse_inputs
from skillwing.services.errors import NoReplyError, RefusedError
from skillwing.services.names import skill_process
from skillwing.services.protocol import SkillReady
from skillwing.services.terminal import completion
from skillwing.services.terminal.connection import InputsArgument, JsonOption, RobotOption, System, connect
from skillwing.services.terminal.exit_codes import FAILED, OK
from skillwing.services.terminal.output import DOES_NOT_ANSWER, make_console, print_json, print_table
from skillwing.services.terminal.ready_text import lines, rows
from skillwing.services.terminal.start_advice import ready_advice
from skillwing.services.terminal.system_state import system_state

NOBODY_RUNS_IT = "No manager of it runs; see `skillwing status`."
HANGS = f"{DOES_NOT_ANSWER[0].upper()}{DOES_NOT_ANSWER[1:]}."


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
        # Who answers is there, even if its alive token is late, as on a busy machine.
        quiet = [each.skill for each in report.skills if not _answers(system, each.skill)]
        alive = system.alive() if quiet else ()
        silent = [each for each in quiet if skill_process(each) in alive]
        unmanaged = [each for each in quiet if each not in silent]
        advice = None if as_json or skill is None else _advice(system, report.skills[0])
    troubles = {**dict.fromkeys(unmanaged, system.addressed(NOBODY_RUNS_IT)), **dict.fromkeys(silent, HANGS)}
    if as_json:
        managers = {"without_manager": unmanaged, "silent_manager": silent}
        print_json({"step": report.step, "t": report.t, "skills": report.skills, **managers})
    elif skill is None:
        print_table(make_console(), ("SKILL", "READY", "WHY"), rows(report.skills, troubles))
    else:
        console = make_console()
        for line in lines(report.skills[0], advice, troubles.get(skill, "")):
            console.print(system.addressed(line), markup=False)
    raise typer.Exit(OK if skill is None or (report.skills[0].ready and not troubles) else FAILED)


def _answers(system: System, skill: str) -> bool:
    """True if the manager of a skill answers a question. One with a hook that blocks does not."""
    try:
        system.ask_for_goal(skill)
    except NoReplyError:
        return False
    return True


def _advice(system: System, skill: SkillReady) -> list[str] | None:
    """Ways to make the skill ready; None without the states of the resources."""
    if skill.ready:
        return []
    try:
        return list(ready_advice(system.skillset, skill, system_state(system)))
    except (NoReplyError, RefusedError):
        return None
