"""`skillwing mission`: list, check and write the missions there are, and fly one on the running system."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from skillwing.bt_missions.checking.mission_check import check_mission, offline_context, require_fit
from skillwing.bt_missions.cli.foreground import fly, say
from skillwing.bt_missions.cli.watch import MissionWatch, status_line, stay
from skillwing.bt_missions.library import find_draft, find_mission, installed_missions
from skillwing.bt_missions.mission.mission import Mission
from skillwing.bt_missions.mission.options import parse_options, written
from skillwing.bt_missions.mission.problems import FaultyMissionError
from skillwing.bt_missions.running.runner import MissionNode
from skillwing.bt_missions.running.tree_snapshot import render_tree
from skillwing.bt_missions.xml.writer import write_mission, write_models
from skillwing.dsl import load
from skillwing.services.errors import InvalidOptionError, NoReplyError, NoSystemError, RefusedError, SkillwingError
from skillwing.services.protocol import (
    AbortMission,
    ErrorCode,
    Keys,
    MissionPhase,
    MissionStatus,
    PauseMission,
    ResumeMission,
)
from skillwing.services.robot import find_robot
from skillwing.services.terminal.completion import missions
from skillwing.services.terminal.connection import JsonOption, RobotOption, System, connect, mission_context
from skillwing.services.terminal.exit_codes import FAILED, OK
from skillwing.services.terminal.output import make_console, print_json, print_table

MissionName = Annotated[
    str,
    typer.Argument(metavar="NAME", help="Mission, or a file (.xml, .py).", show_default=False, autocompletion=missions),
]
OptionWords = Annotated[
    list[str] | None,
    typer.Argument(metavar="OPTION=VALUE", help='Options, as in speed=1.5 "route=30,0,4; 30,20,4; 0,0,4".'),
]
OutputOption = Annotated[
    Path | None, typer.Option("-o", "--output", metavar="FILE", help="Write there instead of to the terminal.")
]
RobotTableOption = Annotated[
    str, typer.Option("--robot", "-r", metavar="NAME", help="Robot that it has to fit: name, or folder of its package.")
]
SkillsetOption = Annotated[
    Path | None, typer.Option(metavar="FILE", help="Skillset that it has to fit, instead of a robot's.")
]
ReasonOption = Annotated[str | None, typer.Option(metavar="TEXT", help="Why; the timeline tells it.")]

FIRST_LOOK = 2.0
"""Wall seconds within which what a mission has published comes in again."""
SECOND_LOOK = 0.5
"""Wall seconds for what skills and managers have published."""
mission = typer.Typer(
    no_args_is_help=True, add_completion=False, help="Begin, check, fly, pause, watch and list missions."
)


@mission.command("list")
def list_missions(as_json: JsonOption = False) -> None:
    """List the installed missions with their options. With --json `options` are those that have a default.

    Exit codes: 0, 1 one of them cannot be loaded.
    """
    found: list[Mission] = []
    broken: list[str] = []
    for name in installed_missions():
        try:
            found.append(find_mission(name))
        except InvalidOptionError as error:
            broken.append(str(error))
    if as_json:
        print_json([{"mission": each.name, "summary": each.summary, "options": each.describe()} for each in found])
    else:
        _print_missions(found, make_console())
    if broken:
        raise SkillwingError(" ".join(broken))


def _print_missions(missions: list[Mission], console: Console) -> None:
    for each in missions:
        console.print(f"{each.name}: {each.summary}", style="bold")
        defaults = each.describe()
        rows = [(name, written(defaults[name]) if name in defaults else "to be given") for name in each.option_names]
        print_table(console, ("OPTION", "DEFAULT"), rows)


@mission.command()
def run(
    name: MissionName,
    options: OptionWords = None,
    robot: RobotOption = None,
    as_json: JsonOption = False,
) -> None:
    """Fly a mission on the running system and show what it does until it is over. Ctrl-C aborts it and lands.

    So do `kill` and a closed terminal; a second Ctrl-C leaves the drone to itself.

    Where the system runs in a chosen world (`up --world KIND`) the mission knows its site, as a planner would tell it;
    options that are given count first.

    Exit codes: 0 it succeeded, 1 it failed or was aborted, 2 it was not flown: unknown name, malformed value, or it
    does not fit the robot; 3 no system is running, 4 another mission flies.
    """
    chosen = find_draft(name)
    asked = parse_options(options or [])
    chosen.read_options(asked)
    console = None if as_json else make_console()
    with _connected_to_fly(chosen, robot) as system:
        _refuse_beside_another(system)
        known = mission_context(system.target, chosen.name)
        told = {key: value for key, value in known.items() if key in chosen.option_names and key not in asked}
        given = chosen.read_options(told | asked)
        require_fit(chosen, system.skillset, given)
        if console is not None and told:
            site = "  ".join(f"{key}={written(value)}" for key, value in told.items())
            console.print(f"Known of the site: {site}", highlight=False)

        def show(status: MissionStatus) -> None:
            say(console, status_line(status))

        node = MissionNode(chosen, system.skillset, given, on_status=show)
        fly(system, node, console)
    if console is None:
        print_json(node.status)
    elif node.status.phase != MissionPhase.SUCCEEDED and node.tree_shows_end:
        say(console, render_tree(node.snapshot))
    raise typer.Exit(OK if node.status.phase == MissionPhase.SUCCEEDED else FAILED)


@mission.command()
def watch(robot: RobotOption = None, as_json: JsonOption = False) -> None:
    """Show the mission that flies: its tree, its skills and why it changed branches; live, until it is over or q.

    Where nobody looks on, or with --json, once. Exit codes: 0, 1 it failed or was aborted, 3 no system is running.
    """
    console = make_console()
    with connect(robot, wait_for_clock=False) as system:
        seen = MissionWatch(system)
        system.bus.run_until(lambda: seen.complete, FIRST_LOOK)
        system.bus.run_until(lambda: False, SECOND_LOOK)
        if as_json:
            print_json({"status": seen.status, "tree": seen.tree})
        elif console.is_terminal and seen.status is not None:
            stay(system, seen, console)
        else:
            console.print(seen.picture())
    raise typer.Exit(FAILED if seen.failed else OK)


@mission.command()
def pause(reason: ReasonOption = None, robot: RobotOption = None, as_json: JsonOption = False) -> None:
    """Make the drone hold its place until `skillwing mission resume`. Battery and fence are watched meanwhile.

    Exit codes: 0 it is paused, 1 no mission is there, 3 no system is running, 4 it cannot be paused just now.
    """
    _order(robot, lambda keys: keys.mission_pause, PauseMission, reason, as_json=as_json)


@mission.command()
def resume(reason: ReasonOption = None, robot: RobotOption = None, as_json: JsonOption = False) -> None:
    """Let a paused mission go on where it was.

    Exit codes: 0 it goes on, 1 no mission is there, 3 no system is running, 4 it was not paused.
    """
    _order(robot, lambda keys: keys.mission_resume, ResumeMission, reason, as_json=as_json)


@mission.command()
def abort(reason: ReasonOption = None, robot: RobotOption = None, as_json: JsonOption = False) -> None:
    """Call the mission off: the drone stops and lands where it is. Repeating it changes nothing.

    Exit codes: 0 it was told, 1 no mission is there, 3 no system is running.
    """
    _order(robot, lambda keys: keys.mission_abort, AbortMission, reason, as_json=as_json)


@mission.command()
def check(
    name: MissionName,
    options: OptionWords = None,
    robot: RobotTableOption = "m600",
    skillset: SkillsetOption = None,
    as_json: JsonOption = False,
) -> None:
    """List everything in a mission that does not fit the robot. Nothing has to run for that.

    With --json a list of `text` and `place`.

    Exit codes: 0 it fits, 1 there are problems, 2 it was not checked: unknown name, malformed value, or a file that is
    not there or no text.
    """
    model = load(skillset or find_robot(robot).skillset)
    try:
        chosen = find_draft(name)
        problems = check_mission(chosen, model, chosen.read_options(parse_options(options or [])))
        called = chosen.name
    except FaultyMissionError as error:
        problems, called = list(error.problems), name
    if as_json:
        print_json(problems)
    else:
        console = make_console()
        for problem in problems:
            console.print(str(problem), soft_wrap=True, markup=False)
        verdict = f"{len(problems)} problem{'s' * (len(problems) != 1)}" if problems else f"fits {model.name}"
        console.print(f"{called}: {verdict}", markup=False)
    raise typer.Exit(FAILED if problems else OK)


@mission.command()
def new(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="NAME.xml or NAME.py.", show_default=False)],
) -> None:
    """Write a small mission to begin with: fly to a point and home again, for the m600.

    Exit codes: 0 written, 2 there is such a file already, or it is neither .xml nor .py.
    """
    write_template(file)
    console = make_console()
    console.print(f"Wrote {file}. Next: `skillwing mission check {file}`, then change it.", soft_wrap=True)


@mission.command()
def export(
    name: MissionName,
    options: OptionWords = None,
    output: OutputOption = None,
    robot: RobotTableOption = "m600",
    skillset: SkillsetOption = None,
) -> None:
    """Write a mission as a tree file (BehaviorTree.CPP 4), with these options as fixed values.

    Exit codes: 0 written, 1 it does something in Python that no tree file can say, 2 unknown name or malformed value.
    """
    chosen = find_mission(name)
    model = load(skillset or find_robot(robot).skillset)
    trees = chosen.build(offline_context(model), chosen.read_options(parse_options(options or [])))
    _put(write_mission(chosen.name, trees, model), output)


@mission.command()
def nodes(output: OutputOption = None, robot: RobotTableOption = "m600", skillset: SkillsetOption = None) -> None:
    """Write the models of the nodes that a tree file may use: the palette that Groot2 imports."""
    _put(write_models(load(skillset or find_robot(robot).skillset)), output)


def _order(
    robot: str | None,
    key: Callable[[Keys], str],
    order: type[AbortMission | PauseMission | ResumeMission],
    reason: str | None,
    *,
    as_json: bool,
) -> None:
    """Tell the mission that flies, and show what it says of itself then."""
    message = order() if reason is None else order(reason=reason)
    with connect(robot) as system:
        try:
            status = system.ask(key(system.keys), message, MissionStatus)
        except NoReplyError as error:
            raise SkillwingError("No mission flies here. Fly one with `skillwing mission run`.") from error
    if as_json:
        print_json(status)
    else:
        make_console().print(status_line(status))


def _put(text: str, output: Path | None) -> None:
    if output is None:
        typer.echo(text, nl=False)
    else:
        output.write_text(text, encoding="utf-8")


@contextmanager
def _connected_to_fly(chosen: Mission, robot: str | None) -> Iterator[System]:
    """The system that is to fly a mission. Where none runs, what is wrong with its file anyway is told rather."""
    try:
        with connect(robot) as system:
            yield system
    except NoSystemError:
        chosen.require_usable()
        raise


def _refuse_beside_another(system: System) -> None:
    """Raise RefusedError if a mission flies, or waits for the robot: a second one would wait for its resources, and
    take off when nobody expects it."""
    if MissionNode.name not in system.alive():
        return
    seen = MissionWatch(system)
    system.bus.run_until(lambda: seen.status is not None, FIRST_LOOK)
    called = f"Mission {seen.status.mission}" if seen.status is not None else "A mission"
    raise RefusedError(
        ErrorCode.NOT_ALLOWED,
        f"{called} flies here already.",
        help="Wait until it has ended, or abort it with `skillwing mission abort`.",
    )


_SOURCES = {".xml": "template.xml", ".py": "template.py.txt"}
"""By suffix. The Python one is text here, for it is no module of this package."""


def write_template(file: Path) -> None:
    """Write a mission that is called like the file.

    Raises InvalidOptionError where there is such a file already, or its suffix says neither XML nor Python.
    """
    if file.suffix not in _SOURCES:
        raise InvalidOptionError("FILE", f"`{file}` ends neither with .xml nor with .py. Name it {file.stem}.xml.")
    text = (Path(__file__).parent / "templates" / _SOURCES[file.suffix]).read_text(encoding="utf-8")
    try:
        with file.open("x", encoding="utf-8") as opened:
            opened.write(text.replace("NAME", file.stem))
    except FileExistsError as error:
        raise InvalidOptionError("FILE", f"There is `{file}` already. Choose another name.") from error
