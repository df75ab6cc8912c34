"""`skillwing start`: the start of a skill, with its progress on request."""

from __future__ import annotations

import signal
from collections.abc import Callable, Mapping
from typing import Annotated, Any

import typer
from rich.console import Console

from skillwing.services.bus import Loop, RunnableBus
from skillwing.services.client.goal_handle import GoalHandle
from skillwing.services.client.inputs import parse_inputs
from skillwing.services.client.interface import SkillsetInterface
from skillwing.services.errors import NoReplyError, RefusedError, SkillwingError
from skillwing.services.names import skill_process
from skillwing.services.processes.stop_signal import StopSignal
from skillwing.services.protocol import Ending, State
from skillwing.services.terminal import completion
from skillwing.services.terminal.connection import InputsArgument, JsonOption, RobotOption, System, connect
from skillwing.services.terminal.exit_codes import OK, exit_code_of_end
from skillwing.services.terminal.link_monitor import follow_link
from skillwing.services.terminal.output import end_text, make_console, print_json, value_text
from skillwing.services.terminal.start_advice import start_advice
from skillwing.services.terminal.system_state import system_state

SILENCE = 2.0
"""Seconds without an answer from a live manager until the user gets a message."""
ACCEPTED = (State.RUNNING, State.INTERRUPTING, State.TERMINATED)


def start(
    skill: Annotated[
        str,
        typer.Argument(metavar="SKILL", help="Skill to start.", show_default=False, autocompletion=completion.skills),
    ],
    inputs: InputsArgument = None,
    follow: Annotated[
        bool, typer.Option("--follow", "-f", help="Show progress until the end; Ctrl-C interrupts the goal.")
    ] = False,
    robot: RobotOption = None,
    as_json: JsonOption = False,
) -> None:
    """Start a skill and wait until it runs, or with --follow until its end.

    Exit codes: 0 it runs (with --follow: it succeeded), 1 it ended otherwise or has no manager, 2 unknown name
    or malformed value, 3 no system is running, 4 the robot refused: not validated, not ready, or busy.
    """
    with connect(robot) as system:
        follow_link(system, lambda sentence: typer.echo(sentence, err=True), _without_link(system, follow=follow))
        values = parse_inputs(system.skillset.skill(skill), inputs or [])
        if skill_process(skill) not in system.alive():
            raise SkillwingError(f"No manager of `{skill}` runs. See with `skillwing status` which do.")
        # A followed goal ends with this process; any other goal goes on without it.
        interface = system.make_interface(owns_goals=follow)
        goal = interface.start(skill, values)
        console = make_console()
        if follow:
            follow_to_end(system.bus, goal, interface.interrupt, None if as_json else console)
        else:
            wait_for(system.bus, goal, lambda: goal.state in ACCEPTED, None if as_json else console)
        advice = [] if as_json else _advice(system, goal, interface, values)
    if as_json:
        print_json({"goal_id": goal.goal_id, "skill": skill, "state": goal.state, "terminal": goal.terminal})
    elif goal.terminal is not None:
        console.print(end_text(goal.terminal))
        for sentence in advice:
            console.print(f"  {sentence}", markup=False)
    else:
        console.print(f"{skill} runs as goal {goal.goal_id}.")
    raise typer.Exit(OK if goal.terminal is None else exit_code_of_end(goal.terminal))


def _without_link(system: System, *, follow: bool) -> str:
    """A sentence on the goal while this command's link to the robot is away."""
    if not follow:
        return "The goal goes on."
    return f"The goal ends after some seconds, unless its skill goes on. {system.target.without_goals}".rstrip()


def _advice(system: System, goal: GoalHandle, interface: SkillsetInterface, values: Mapping[str, Any]) -> list[str]:
    """Advice after a refused start; none without an answer of the resource manager."""
    if goal.terminal is None or goal.terminal.ending not in (Ending.NOT_READY, Ending.BUSY):
        return []
    try:
        (ready,) = system.ask_ready(interface, goal.skill, values).skills
        advice = start_advice(system.skillset, ready, goal.terminal.failing, system_state(system))
        return [system.addressed(sentence) for sentence in advice]
    except (NoReplyError, RefusedError):
        return []


def wait_for(loop: Loop, goal: GoalHandle, condition: Callable[[], bool], console: Console | None) -> None:
    """Wait for a goal, with a message if its manager does not answer the start."""
    if not loop.run_until(lambda: goal.state is not None or condition(), SILENCE) and console is not None:
        console.print(f"The manager of `{goal.skill}` is alive and does not answer; it is given up in half a minute.")
    loop.run_until(condition)


def follow_to_end(
    bus: RunnableBus, goal: GoalHandle, interrupt: Callable[[GoalHandle], object], console: Console | None
) -> None:
    """Show a goal's progress until its end. The first Ctrl-C interrupts the goal.

    Another one, which does not repeat the first, raises KeyboardInterrupt. The goal still stops.
    """
    stop = StopSignal(bus.wall)

    def on_signal(number: int, frame: object) -> None:
        if not stop.received:
            bus.post(interrupt_goal)
        stop.receive()

    def interrupt_goal() -> None:
        if console is not None:
            console.print("Interrupting; Ctrl-C again ends this command without waiting.")
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
