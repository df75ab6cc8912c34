"""`skillwing mission`: list the missions there are, and fly one on the running system."""

from __future__ import annotations

import signal
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.text import Text

from skillwing.bt_missions.running.mission import find_mission, installed_missions
from skillwing.bt_missions.running.option_words import parse_options
from skillwing.bt_missions.running.runner import MissionNode, Phase
from skillwing.bt_missions.running.tree_text import render
from skillwing.services.commands.connection import JsonOption, RobotOption, System, connect
from skillwing.services.commands.exit_codes import FAILED, OK
from skillwing.services.commands.output import make_console, print_json, print_table
from skillwing.services.protocol import MissionStatus

mission = typer.Typer(no_args_is_help=True, help="List and fly missions.")

_COLOURS = {Phase.SUCCEEDED: "bold green", Phase.FAILED: "bold red", Phase.ABORTED: "bold yellow"}


@mission.command("list")
def list_missions(as_json: JsonOption = False) -> None:
    """List the installed missions with their options."""
    found = [find_mission(name) for name in installed_missions()]
    if as_json:
        print_json([{"mission": each.name, "summary": each.summary, "options": each.describe()} for each in found])
        return
    console = make_console()
    for each in found:
        console.print(f"{each.name}: {each.summary}", style="bold")
        print_table(console, ("OPTION", "DEFAULT"), [(key, _written(value)) for key, value in each.describe().items()])


@mission.command()
def run(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Mission to fly.", show_default=False)],
    options: Annotated[
        list[str] | None,
        typer.Argument(metavar="[OPTION=VALUE]...", help='Options, as in speed=1.5 "route=30,0,4; 30,20,4; 0,0,4".'),
    ] = None,
    robot: RobotOption = None,
    as_json: JsonOption = False,
) -> None:
    """Fly a mission on the running system and show what it does until it is over. Ctrl-C aborts it and lands.

    Exit codes: 0 it succeeded, 1 it failed or was aborted, 2 unknown name or malformed value, 3 no system is running.
    """
    chosen = find_mission(name)
    given = chosen.read_options(parse_options(options or []))
    console = None if as_json else make_console()
    with connect(robot) as system:

        def show(status: MissionStatus) -> None:
            if console is not None:
                console.print(_line(status))

        node = MissionNode(chosen, system.skillset, given, on_status=show)
        _fly(system, node, console)
    if console is None:
        print_json(node.status)
    elif node.status.phase != Phase.SUCCEEDED:
        console.print(render(node.snapshot))
    raise typer.Exit(OK if node.status.phase == Phase.SUCCEEDED else FAILED)


def _written(value: Any) -> str:
    """A value as `parse_options` would read it."""
    match value:
        case None:
            return "-"
        case [[*_], *_]:
            return "; ".join(_written(item) for item in value)
        case [*items]:
            return ",".join(_written(item) for item in items)
        case float():
            return f"{value:g}"
        case _:
            return str(value)


def _fly(system: System, node: MissionNode, console: Console | None) -> None:
    """Run the mission to its end. The first Ctrl-C aborts it, the second leaves at once."""

    def on_signal(number: int, frame: object) -> None:
        signal.signal(signal.SIGINT, previous)
        system.bus.post(abort)

    def abort() -> None:
        if console is not None:
            console.print("Aborting: the drone lands where it is. Ctrl-C again leaves it to itself.")
        node.abort("aborted by Ctrl-C")

    previous = signal.signal(signal.SIGINT, on_signal)
    try:
        node.attach(system.bus)
        system.bus.run_until(lambda: node.over)
    finally:
        signal.signal(signal.SIGINT, previous)
        node.detach()


def _line(status: MissionStatus) -> Text:
    text = Text(f"{status.t:8.1f} s  ")
    text.append(f"{status.phase:9}", _COLOURS.get(Phase(status.phase), "default"))
    if status.waypoints:
        text.append(f"  {status.waypoint}/{status.waypoints}", "dim")
    return text.append(f"  {status.text}")
