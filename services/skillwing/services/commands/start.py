"""`skillwing start`: start a skill, and follow it if asked to."""

from __future__ import annotations

import signal
from collections.abc import Callable
from typing import Annotated

import typer
from rich.console import Console

from skillwing.services.bus import Loop, RunnableBus
from skillwing.services.client.goal_handle import GoalHandle
from skillwing.services.commands import completion
from skillwing.services.commands.connection import JsonOption, RobotOption, System, connect
from skillwing.services.commands.exit_codes import OK, exit_code_of_end
from skillwing.services.commands.inputs import parse_inputs
from skillwing.services.commands.output import end_text, make_console, print_json, value_text
from skillwing.services.commands.readiness import way_out_of_busy, ways_out
from skillwing.services.commands.situation import running_skills, situation
from skillwing.services.errors import NoReplyError, RefusedError, SkillwingError
from skillwing.services.names import skill_process
from skillwing.services.processes.ending import Ending
from skillwing.services.protocol import Ending as GoalEnding
from skillwing.services.protocol import State, Terminal

SILENCE = 2.0
"""Seconds without a word from a manager that seems to live, after which the user is told why nothing happens."""
ACCEPTED = (State.RUNNING, State.INTERRUPTING, State.TERMINATED)


def start(
    skill: Annotated[
        str,
        typer.Argument(metavar="SKILL", help="Skill to start.", show_default=False, autocompletion=completion.skills),
    ],
    inputs: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="NAME=VALUE",
            help="Inputs, as in height=5 target=10,5,4 target.x=10.",
            autocompletion=completion.inputs,
        ),
    ] = None,
    follow: Annotated[
        bool, typer.Option("--follow", "-f", help="Show progress until the end; Ctrl-C interrupts the goal.")
    ] = False,
    robot: RobotOption = None,
    as_json: JsonOption = False,
) -> None:
    """Start a skill and wait until it runs, or with --follow until it has ended.

    Exit codes: 0 it runs (with --follow: it succeeded), 1 it ended otherwise or has no manager, 2 unknown name
    or malformed value, 3 no system is running, 4 the robot refused: not validated, not ready, or busy.
    """
    with connect(robot) as system:
        values = parse_inputs(system.skillset.skill(skill), inputs or [])
        if skill_process(skill) not in system.alive():
            raise SkillwingError(f"No manager of `{skill}` runs. See with `skillwing status` which do.")
        # A goal that somebody follows ends with them; the other one is meant to go on without this process.
        interface = system.make_interface(owns_goals=follow)
        goal = interface.start(skill, values)
        console = make_console()
        if follow:
            follow_to_end(system.bus, goal, interface.interrupt, None if as_json else console)
        else:
            wait_for(system.bus, goal, lambda: goal.state in ACCEPTED, None if as_json else console)
        advice = [] if as_json or goal.terminal is None else _advice(system, skill, goal.terminal)
    if as_json:
        print_json({"goal_id": goal.goal_id, "skill": skill, "state": goal.state, "terminal": goal.terminal})
    elif goal.terminal is not None:
        console.print(end_text(goal.terminal))
        for sentence in advice:
            console.print(f"  {sentence}", markup=False)
    else:
        console.print(f"{skill} runs as goal {goal.goal_id}.")
    raise typer.Exit(OK if goal.terminal is None else exit_code_of_end(goal.terminal))


def _advice(system: System, skill: str, terminal: Terminal) -> list[str]:
    """How a skill that was refused can be made to start; nothing where nobody tells how the resources are."""
    try:
        if terminal.ending is GoalEnding.NOT_READY:
            return list(ways_out(system.skillset, system.skillset.skill(skill), terminal.failing, situation(system)))
        if terminal.ending is GoalEnding.BUSY:
            running = running_skills(system, system.alive())
            return [way_out_of_busy(skill, running[skill])] if skill in running else []
    except (NoReplyError, RefusedError):
        pass
    return []


def wait_for(loop: Loop, goal: GoalHandle, condition: Callable[[], bool], console: Console | None) -> None:
    """Wait for a goal, and say so on the console if its manager leaves the start unanswered."""
    if not loop.run_until(lambda: goal.state is not None or condition(), SILENCE) and console is not None:
        console.print(f"The manager of `{goal.skill}` is alive and does not answer; it is given up in half a minute.")
    loop.run_until(condition)


def follow_to_end(
    bus: RunnableBus, goal: GoalHandle, interrupt: Callable[[GoalHandle], object], console: Console | None
) -> None:
    """Show what a goal does until it is over. The first Ctrl-C interrupts the goal.

    Another one, which is no repetition of the first, raises KeyboardInterrupt and leaves the goal alone.
    """
    ending = Ending(bus.wall)

    def on_signal(number: int, frame: object) -> None:
        if not ending.told:
            bus.post(stop)
        ending.note()

    def stop() -> None:
        if console is not None:
            console.print("Interrupting; Ctrl-C again leaves the goal to itself.")
        interrupt(goal)

    def show(goal: GoalHandle) -> None:
        if console is not None and goal.terminal is None:
            console.print(f"{bus.now() - begun:6.1f} s  {goal.state}  {value_text(goal.progress or {})}".rstrip())

    begun = bus.now()
    previous = signal.signal(signal.SIGINT, on_signal)
    goal.on_change(show)
    try:
        wait_for(bus, goal, lambda: goal.done, console)
    finally:
        signal.signal(signal.SIGINT, previous)
