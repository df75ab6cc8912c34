"""`skillwing mission`: list, write, check and run missions, and control the one that runs."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

from skillwing.bt_missions.checking.mission_check import check_mission, check_mission_on, offline_contexts, require_fit
from skillwing.bt_missions.cli.draft import write_draft
from skillwing.bt_missions.cli.foreground import print_if_open, print_link, run_in_foreground, without_link
from skillwing.bt_missions.cli.mission_robots import (
    RobotTablesOption,
    RunningRobotsOption,
    addressed_text,
    chosen_robots,
    connected,
    models_of,
    only_name,
    robot_names,
    robots_on_board,
)
from skillwing.bt_missions.cli.on_board import begins_on_board, known_mission, make_request, run_on_board
from skillwing.bt_missions.cli.robot_choice import ChosenRobot, choose_robot
from skillwing.bt_missions.cli.watch import MissionWatch, show_live, status_line
from skillwing.bt_missions.library import UnknownMissionError, find_draft, find_mission, installed_missions
from skillwing.bt_missions.mission.mission import Mission, MissionOptions
from skillwing.bt_missions.mission.options import option_text, parse_options
from skillwing.bt_missions.mission.problems import FaultyMissionError
from skillwing.bt_missions.mission.robots import RobotModel, occupied, require_distinct
from skillwing.bt_missions.running.runner import MissionNode
from skillwing.bt_missions.running.tree_snapshot import render_tree
from skillwing.bt_missions.tree_skill.called import called_skill_problems
from skillwing.bt_missions.xml.writer import write_mission, write_mission_on_robots, write_models
from skillwing.dsl.model import Skillset, UnknownNameError
from skillwing.dsl.suggest import listed
from skillwing.dsl.whole_files import write_whole
from skillwing.services.access.identity_files import ending_soon
from skillwing.services.client.interface import require_allowed
from skillwing.services.client.joining import robots_with_missions
from skillwing.services.errors import (
    InvalidOptionError,
    NoMissionError,
    NoReplyError,
    NoSystemError,
    RefusedError,
    SkillwingError,
)
from skillwing.services.ids import new_goal_id
from skillwing.services.protocol import (
    LONGEST_OWNER_GRACE,
    AbortMission,
    ErrorCode,
    Keys,
    MissionPhase,
    MissionStatus,
    PauseMission,
    ResumeMission,
)
from skillwing.services.terminal.completion import missions
from skillwing.services.terminal.connection import JsonOption, RobotOption, System, connect, mission_context
from skillwing.services.terminal.exit_codes import FAILED, OK
from skillwing.services.terminal.link_monitor import follow_link
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
    str | None,
    typer.Option(
        "--robot",
        "-r",
        metavar="NAME",
        help="Robot: name, or folder of its package. By default the one that runs, else the m600.",
        show_default=False,
    ),
]
SkillsetOption = Annotated[
    Path | None, typer.Option(metavar="FILE", help="Skillset to check against, instead of a robot's.")
]
ReasonOption = Annotated[str | None, typer.Option(metavar="TEXT", help="Reason, for the timeline.")]

STATUS_TIMEOUT = 2.0
"""Longest wait for the latest status and tree of a mission, in seconds of wall time."""
SKILLS_WAIT = 0.5
"""Wait for the latest messages of skills and managers, in seconds of wall time."""
mission = typer.Typer(
    no_args_is_help=True, add_completion=False, help="List, write, check, run, pause and watch missions."
)


@mission.command("list")
def list_missions(robot: RobotTableOption = None, as_json: JsonOption = False) -> None:
    """List the installed missions with their options. With --json, `options` holds those with a default.

    For a robot that runs, or that is named, it lists those that fit its skillset.

    Exit codes: 0; 1 a mission cannot be loaded.
    """
    chosen = choose_robot(robot)
    found: list[Mission] = []
    broken: list[str] = []
    for name in installed_missions():
        try:
            found.append(find_mission(name))
        except InvalidOptionError as error:
            broken.append(str(error))
    fitting = [each for each in found if not chosen.is_chosen or _fits(each, chosen)]
    if as_json:
        print_json([{"mission": each.name, "summary": each.summary, "options": each.describe()} for each in fitting])
    else:
        _print_missions(fitting, make_console())
        if len(fitting) < len(found):
            others = listed(each.name for each in found if each not in fitting)
            make_console().print(f"Other installed missions do not fit {chosen.skillset.name}: {others}.")
    if broken:
        raise SkillwingError(" ".join(broken))


def _fits(mission: Mission, robot: ChosenRobot) -> bool:
    """True if the mission fits the robot with the defaults of its options; those without a default are not checked."""
    try:
        options = mission.read_options({})
    except InvalidOptionError:
        return set(mission.needs) <= {resource.name for resource in robot.skillset.resources}
    return not check_mission(mission, robot.skillset, options, robot.rescue_goal)


def _print_missions(missions: list[Mission], console: Console) -> None:
    for each in missions:
        console.print(f"{each.name}: {each.summary}", style="bold")
        defaults = each.describe()
        rows = [(name, option_text(defaults[name]) if name in defaults else "required") for name in each.option_names]
        print_table(console, ("OPTION", "DEFAULT"), rows)


@mission.command()
def run(
    name: MissionName,
    options: OptionWords = None,
    robot: RunningRobotsOption = None,
    on_board: Annotated[
        bool, typer.Option("--on-board", help="Run it on the robot: this command may come and go.")
    ] = False,
    owner_grace: Annotated[
        float | None,
        typer.Option(
            metavar="SECONDS",
            min=0.0,
            max=LONGEST_OWNER_GRACE,
            help="Time for which goals run on while the link to the robot is away, by default the mission's own.",
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Run a mission on the running system, and show its progress until it is over. See docs/missions.md.

    A mission on several robots takes each by name: `--robot left=NAME --robot right=NAME`. See docs/own_mission.md.

    Ctrl-C, `kill` and a closed terminal abort the mission: its goals are interrupted, and its tree `rescue` runs. A
    second Ctrl-C ends the command at once, without the rescue.

    With --on-board the robot's launcher runs the mission, and a broken link to the robot does not matter to it. Ctrl-C
    then ends this view only; `skillwing mission abort` aborts. Of several robots the first one's launcher runs the
    mission, or that of one more `--robot NAME`. See docs/ground_station.md.

    If the system runs in a chosen world (`up --world KIND`), options of the site are set as a planner would set them.
    Options on the command line have priority.

    Exit codes: 0 it succeeded; 1 it failed or was aborted; 2 it did not run (unknown name, malformed value, or it
    does not fit the robot); 3 no system is running; 4 another mission runs, or your keys do not allow it.
    """
    asked = parse_options(options or [])
    if on_board:
        raise typer.Exit(_run_on_board(name, asked, robot or [], owner_grace, as_json=as_json))
    chosen = _find(name, only_name(robot))
    chosen.read_options(asked)
    console = None if as_json else make_console()
    names = robot_names(chosen, robot or [])
    require_distinct(names)
    with _connected_to_run(chosen, names) as systems:
        models = models_of(systems)
        for system in systems.values():
            if name in installed_missions() and not chosen.robots:
                _refuse_other_robot(chosen, system.skillset)
        given = _options_with_site(chosen, asked, systems, console)

        first = next(iter(systems.values()))
        running = {role: each.target.robot for role, each in systems.items()}

        def show(status: MissionStatus) -> None:
            print_if_open(console, status_line(status, addressed_text(status.text, first, running)))

        grace = chosen.owner_grace if owner_grace is None else owner_grace
        node = MissionNode.on_robots(chosen, models, given, owner_grace=grace, on_status=show)
        for system in systems.values():
            require_allowed(system.bus, system.keys.start("*"))
        for role in occupied(models):  # as late as possible: meanwhile another station may start a mission
            _refuse_second_mission(systems[role])
        if warning := ending_soon(first.bus.identity):
            typer.echo(warning, err=True)
        follow_link(first, lambda text: print_link(console, text), without_link(grace, first.target))
        run_in_foreground(systems, node, console)
    if console is None:
        print_json(node.status)
    elif node.status.phase != MissionPhase.SUCCEEDED and node.tree_shows_end:
        print_if_open(console, render_tree(node.snapshot))
    raise typer.Exit(OK if node.status.phase == MissionPhase.SUCCEEDED else FAILED)


@mission.command()
def watch(robot: RobotOption = None, as_json: JsonOption = False) -> None:
    """Show the mission that runs: its tree, its skills, and the reasons of its branch switches. q ends the command.
    See docs/missions.md.

    The view is live until the mission is over. With --json, or without a terminal, it is printed once.

    Exit codes: 0; 1 it failed or was aborted; 3 no system is running.
    """
    console = make_console()
    with connect(robot, wait_for_clock=False) as system:
        seen = MissionWatch(system)
        system.bus.run_until(lambda: seen.complete, STATUS_TIMEOUT)
        system.bus.run_until(lambda: False, SKILLS_WAIT)
        if as_json:
            print_json({"status": seen.status, "tree": seen.tree})
        elif console.is_terminal and seen.status is not None:
            show_live(system, seen, console)
        else:
            console.print(seen.view())
    raise typer.Exit(FAILED if seen.failed else OK)


@mission.command()
def pause(reason: ReasonOption = None, robot: RobotOption = None, as_json: JsonOption = False) -> None:
    """Hold the mission until `skillwing mission resume`. Its guards are active meanwhile. See docs/missions.md.

    Exit codes: 0 it is paused; 1 no mission runs; 3 no system is running; 4 it cannot be paused now.
    """
    _send(robot, lambda keys: keys.mission_pause, PauseMission, reason, as_json=as_json)


@mission.command()
def resume(reason: ReasonOption = None, robot: RobotOption = None, as_json: JsonOption = False) -> None:
    """Continue a paused mission where it was. See docs/missions.md.

    Exit codes: 0 it continues; 1 no mission runs; 3 no system is running; 4 it was not paused.
    """
    _send(robot, lambda keys: keys.mission_resume, ResumeMission, reason, as_json=as_json)


@mission.command()
def abort(reason: ReasonOption = None, robot: RobotOption = None, as_json: JsonOption = False) -> None:
    """Abort the mission: its goals are interrupted, and its tree `rescue` runs. A second request has no effect. See
    docs/missions.md.

    Exit codes: 0 the request was accepted; 1 no mission runs; 3 no system is running.
    """
    _send(robot, lambda keys: keys.mission_abort, AbortMission, reason, as_json=as_json)


@mission.command()
def check(
    name: MissionName,
    options: OptionWords = None,
    robot: RobotTablesOption = None,
    skillset: SkillsetOption = None,
    as_json: JsonOption = False,
) -> None:
    """List all problems of a mission with its robots, and of the trees of skills that it starts. No system has to run.
    See docs/own_mission.md.

    With --json the output is a list of `text` and `place`.

    Exit codes: 0 it fits; 1 there are problems; 2 it was not checked (unknown name, malformed value, or a file that
    cannot be read).
    """
    robots = "the robot"
    try:
        chosen = _find(name, only_name(robot), skillset)
        models = chosen_robots(chosen, robot or [], skillset)
        robots = ", ".join(
            f"{role} ({each.skillset.name})" if role else each.skillset.name for role, each in models.items()
        )
        given = chosen.read_options(parse_options(options or []))
        known = {role: RobotModel(each.skillset, each.rescue_goal) for role, each in models.items()}
        problems = check_mission_on(chosen, known, given)
        for each in models.values() if not chosen.robots else ():
            problems += called_skill_problems(chosen, each.skillset, given, each.skills_folder)
        called = chosen.name
    except FaultyMissionError as error:
        problems, called = list(error.problems), name
    if as_json:
        print_json(problems)
    else:
        console = make_console()
        for problem in problems:
            console.print(str(problem), soft_wrap=True, markup=False)
        count = f"{len(problems)} problem{'s' * (len(problems) != 1)}"
        verdict = f"{count} with {robots}" if problems else f"fits {robots}"
        console.print(f"{called}: {verdict}", markup=False)
    raise typer.Exit(FAILED if problems else OK)


@mission.command()
def new(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="NAME.xml or NAME.py.", show_default=False)],
    robot: RobotTableOption = None,
    skillset: SkillsetOption = None,
) -> None:
    """Write a small mission to start from: skills of the robot in an order that their preconditions allow, or the draft
    of its table. See docs/own_mission.md.

    Exit codes: 0 written; 2 the file exists already, its name is not one of a mission, or the robot's rescue goal is
    wrong.
    """
    chosen = choose_robot(robot, skillset)
    write_draft(file, chosen)
    whose = f" for {chosen.skillset.name}"
    if not chosen.is_chosen:
        whose += ", as no robot runs and none is named"
    against = ["--skillset", str(skillset)] if skillset is not None else ["--robot", robot] if robot is not None else []
    command = shlex.join(["skillwing", "mission", "check", str(file), *against])
    make_console().print(f"Wrote {file}{whose}. Next: `{command}`, then change it.", soft_wrap=True, markup=False)


@mission.command()
def export(
    name: MissionName,
    options: OptionWords = None,
    output: OutputOption = None,
    robot: RobotTablesOption = None,
    skillset: SkillsetOption = None,
) -> None:
    """Write a mission as a tree file (BehaviorTree.CPP 4), with these options as fixed values. See docs/own_mission.md.

    Exit codes: 0 written; 1 a part of it is Python code, which a tree file cannot hold; 2 unknown name, malformed
    value, or it does not fit the robot.
    """
    chosen = find_mission(name)
    robots = chosen_robots(chosen, robot or [], skillset)
    models = {role: RobotModel(each.skillset, each.rescue_goal) for role, each in robots.items()}
    given = chosen.read_options(parse_options(options or []))
    if check_mission_on(chosen, models, given):
        names = listed(dict.fromkeys(model.skillset.name for model in models.values()))
        fit = f"Mission `{chosen.name}` does not fit {names}"
        raise InvalidOptionError("mission", f"{fit}. `skillwing mission check` with the same words lists its problems.")
    trees = chosen.build(offline_contexts(models), given)
    skillsets = {role: model.skillset for role, model in models.items()}
    if chosen.robots:
        _put(write_mission_on_robots(chosen, trees, skillsets), output)
    else:
        _put(write_mission(chosen.name, trees, skillsets[""]), output)


@mission.command()
def nodes(output: OutputOption = None, robot: RobotTableOption = None, skillset: SkillsetOption = None) -> None:
    """Write the models of all nodes of tree files: the palette that Groot2 imports. See docs/own_mission.md."""
    _put(write_models(choose_robot(robot, skillset).skillset), output)


def _run_on_board(
    name: str, asked: dict[str, Any], words: list[str], owner_grace: float | None, *, as_json: bool
) -> int:
    if owner_grace is not None:
        text = "A mission on board needs no --owner-grace: it is not cut off from its goals. Leave it out."
        raise InvalidOptionError("owner-grace", text)
    mission = known_mission(name)
    robots = robots_on_board(mission, words)
    request = make_request(name, asked, robots.names, new_goal_id(), mission)
    if mission is None or not request.tree:  # the robot itself checks an installed mission
        with connect(robots.launcher) as system:
            return run_on_board(system, request, None if as_json else make_console())
    given = mission.read_options(asked)
    roles = robots.names or {"": robots.launcher}
    with connected(roles) as systems:
        # Problems have places in the file as it is here.
        require_fit(mission, models_of(systems), given)
        role = next(role for role, robot in roles.items() if robot == robots.launcher)
        return run_on_board(systems[role], request, None if as_json else make_console())


def _send(
    robot: str | None,
    key: Callable[[Keys], str],
    kind: type[AbortMission | PauseMission | ResumeMission],
    reason: str | None,
    *,
    as_json: bool,
) -> None:
    """Send a request to the mission that runs, and print its status after it."""
    message = kind() if reason is None else kind(reason=reason)
    with connect(robot) as system:
        try:
            status = system.ask(key(system.keys), message, MissionStatus)
        except NoReplyError as error:
            having = robots_with_missions(system.target.endpoint)
            if system.target.robot in having:
                raise
            raise NoMissionError(having) from error
    if as_json:
        print_json(status)
    else:
        make_console().print(status_line(status, system.addressed(status.text)))


def _put(text: str, output: Path | None) -> None:
    if output is None:
        typer.echo(text, nl=False)
    else:
        write_whole(output, text)


@contextmanager
def _connected_to_run(chosen: Mission, names: Mapping[str, str | None]) -> Iterator[dict[str, System]]:
    """The systems for a mission. If one does not run, problems of the mission's file are reported first."""
    try:
        with connected(names) as systems:
            yield systems
    except NoSystemError:
        chosen.require_usable()
        raise


def _find(name: str, robot: str | None, skillset: Path | None = None) -> Mission:
    """Find a mission as `find_draft` does. An unknown name is answered with the missions that fit the robot."""
    try:
        return find_draft(name)
    except UnknownMissionError as error:
        try:
            chosen = choose_robot(robot, skillset)
            others = error.known if chosen.is_chosen else ()
            unfit = [each for each in others if not _fits(find_mission(each), chosen)]
        except (InvalidOptionError, UnknownNameError):  # no robot is known, or a mission cannot be loaded
            raise error from None
        raise UnknownMissionError(name, unfit, chosen.skillset.name) from None


def _refuse_other_robot(mission: Mission, skillset: Skillset) -> None:
    """Raise InvalidOptionError for an installed mission of another robot, whose many problems nobody can correct."""
    lacking = [name for name in mission.needs if name not in {resource.name for resource in skillset.resources}]
    if lacking:
        text = f"Mission `{mission.name}` is for another robot: `{skillset.name}` has no resource {listed(lacking)}."
        raise InvalidOptionError("mission", f"{text} `skillwing mission list` shows the missions that fit.")


def _options_with_site(
    chosen: Mission, asked: dict[str, Any], systems: Mapping[str, System], console: Console | None
) -> MissionOptions:
    """Options of a mission: those that the user gives, then those of the site of its only robot. Raises
    FaultyMissionError."""
    only = systems.get("")
    known = {} if only is None else mission_context(only.target, chosen.name)
    site = {key: value for key, value in known.items() if key in chosen.option_names and key not in asked}
    given = chosen.read_options(site | asked)
    require_fit(chosen, models_of(systems), given)
    if console is not None and site:
        text = "  ".join(f"{key}={option_text(value)}" for key, value in site.items())
        console.print(f"Options of the site: {text}", highlight=False)
    return given


def _refuse_second_mission(system: System) -> None:
    """Raise RefusedError if a mission runs or waits for the robot.

    A second mission would wait for the same resources, and begin when nobody expects it.
    """
    if MissionNode.name in system.alive():
        seen = MissionWatch(system)
        system.bus.run_until(lambda: seen.status is not None, STATUS_TIMEOUT)
        mission = seen.status.mission if seen.status is not None else begins_on_board(system)
    else:
        mission = begins_on_board(system)
        if mission is None:
            return
    name = "A mission" if mission is None else f"Mission {mission}"
    raise RefusedError(
        ErrorCode.NOT_ALLOWED,
        f"{name} runs here already.",
        help=system.addressed("Wait until it has ended, or abort it with `skillwing mission abort`."),
    )
