"""`skillwing up`: a robot's processes, started and supervised, or left to themselves."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer

from skillwing.services.errors import InvalidOptionError
from skillwing.services.mocking.script_file import load_scripts
from skillwing.services.mocking.system import mock_processes, scripts_for, without_layer
from skillwing.services.processes.router import LOOPBACK
from skillwing.services.processes.run_options import LARGEST_SEED
from skillwing.services.recording.retention import KEEP
from skillwing.services.robot import ProcessSpec, Robot, find_robot
from skillwing.services.terminal.completion import robots, skills
from skillwing.services.terminal.system_options import (
    ColocateOption,
    DetachOption,
    DurableOption,
    InsecureOption,
    KeepOption,
    KeysOption,
    ListenOption,
    RecordOption,
    ResumeOption,
    RobotNameOption,
    RouterOption,
    RunDirOption,
    RunSettings,
    SpeedOption,
    TopologyOption,
    ViewerOption,
    require_robot_name,
    speed_word,
)
from skillwing.services.terminal.system_runner import prepare_run, run_detached, run_system

WORLD_SEED = 1


def up(
    mocked: Annotated[
        list[str] | None,
        typer.Argument(metavar="SKILL", help="With --mock: skills to mock, default all.", autocompletion=skills),
    ] = None,
    robot: Annotated[
        str,
        typer.Option(
            "--robot",
            "-r",
            metavar="NAME",
            help="Robot to run: its name or its package's folder.",
            autocompletion=robots,
        ),
    ] = "m600",
    speed: SpeedOption = 1.0,
    seed: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            min=0,
            max=LARGEST_SEED,
            help="Of the simulated world, default 1; of mocks, default their script's.",
        ),
    ] = None,
    world: Annotated[
        str | None,
        typer.Option(metavar="KIND", help="Simulated world, default courtyard; `skillwing world` lists them."),
    ] = None,
    mock: Annotated[
        bool, typer.Option("--mock", help="Mock skills: all of them without a robot, or those named.")
    ] = False,
    script: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Script of the mocks, in addition to NAME.mock.toml beside the skillset."),
    ] = None,
    scenario: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Scenario of a simulated robot: faults, wind and more. See docs/sensors.md."),
    ] = None,
    beside: Annotated[
        list[str] | None,
        typer.Option("--with", metavar="NAME", help="Further robot in the simulated world of this one. Repeatable."),
    ] = None,
    world_of: Annotated[
        str | None,
        typer.Option("--world-of", metavar="NAME", help="Join the simulated world of this robot; see --with."),
    ] = None,
    detach: DetachOption = False,
    colocate: ColocateOption = False,
    topology: TopologyOption = "router",
    router: RouterOption = None,
    robot_name: RobotNameOption = None,
    listen: ListenOption = LOOPBACK,
    keys: KeysOption = None,
    insecure: InsecureOption = False,
    run_dir: RunDirOption = None,
    resume: ResumeOption = False,
    durable: DurableOption = False,
    record: RecordOption = True,
    keep: KeepOption = KEEP,
    viewer: ViewerOption = "none",
) -> None:
    """Start a robot's processes and stay with them until Ctrl-C.

    The run is recorded in its directory (docs/recordings.md), with a report of each mission.

    With --mock no robot is needed: all skills and the world around them are mocks. See docs/mocks.md. `up --mock goto
    hover` mocks these skills only; the others, and the robot, are real. A robot without a functional layer gets a
    mocked world.

    Several robots can share one router, each in a namespace of its name: `up --robot-name second --router
    tcp/127.0.0.1:PORT`. Their commands then take `--robot second`. See docs/operations.md.

    Several robots can share one simulated world: `up --robot-name left --with right --listen
    tcp/127.0.0.1:7447`, then `up --robot-name right --world-of left --router tcp/127.0.0.1:7447`. See docs/worlds.md.

    With --resume the resource manager continues from the journal of an earlier run, with its states, goals and tokens.
    Use it for a robot that has kept its state meanwhile; a simulated one has not.

    Exit codes: 0 it was told to stop, 1 it did not start or lost an essential process, 2 unknown robot, wrong options
    or keys. With --detach: 0 it runs, 1 it did not start or runs without one of its processes.
    """
    table = _renamed(find_robot(robot), robot_name)
    skills = tuple(dict.fromkeys(mocked or ()))
    _check_mocks(table, mock, skills, script)
    everything = mock and not skills
    if everything or not table.functional_layer({}):
        _check_no_simulation(
            {"world": world, "scenario": scenario, "shared world": beside or world_of}, everything=everything
        )
    run: dict[str, Any] = {"seed": WORLD_SEED if seed is None else seed, "speed": speed, "durable": durable}
    run |= {} if world is None else {"world": world}
    run |= {} if scenario is None else {"scenario": _existing(scenario)}
    run |= _shared_world(table.name, beside or [], world_of, router)
    started = without_layer(table) if everything else table
    started.check(run)
    settings = RunSettings(
        clock="wall" if everything else table.clock,
        listen=listen,
        mock=everything,
        topology=topology,
        colocate=colocate,
        router=router,
        mission_context=started.mission_options(run),
        resume=resume,
        durable=durable,
        record=record,
        keep=keep,
        options={} if everything else run,
        viewer=viewer,
        keys=keys,
        insecure=insecure,
    )

    def make_processes() -> tuple[ProcessSpec, ...]:
        layer = () if everything else table.functional_layer(run)
        if not mock:
            return (*layer, *table.managers(run))
        scripts = scripts_for(table.skillset, script)
        mocks = mock_processes(table, scripts=scripts, seed=seed, skills=skills or None, world=not layer, run=run)
        return (*layer, *mocks)

    directory = prepare_run(started, make_processes(), run_dir, "up", settings, detach=detach)
    if detach:
        # The words of this call cannot be used again: any of them, such as `-dr`, may mean --detach.
        words = ["up", *skills, "--robot", robot, "--speed", speed_word(speed), *settings.words()]
        words += [] if robot_name is None else ["--robot-name", robot_name]
        words += [] if seed is None else ["--seed", str(seed)]
        words += [] if world is None else ["--world", world]
        words += ["--mock"] if mock else []
        words += [] if script is None else ["--script", str(script.absolute())]
        words += [] if scenario is None else ["--scenario", str(scenario.absolute())]
        words += [word for name in beside or () for word in ("--with", name)]
        words += [] if world_of is None else ["--world-of", world_of]
        raise typer.Exit(run_detached(table.name, words, directory))
    run |= {"run_dir": str(directory), "keep": keep}
    raise typer.Exit(run_system(started, make_processes(), directory, settings))


def _shared_world(own: str, beside: list[str], world_of: str | None, router: str | None) -> dict[str, Any]:
    """Options of a run for robots in one simulator. Raises InvalidOptionError for names that do not fit together."""
    if world_of is not None and (beside or router is None):
        text = "A robot joins the simulator of another one at that robot's router. Give `--router`, and no `--with`."
        raise InvalidOptionError("world-of", text)
    for name in beside:
        require_robot_name(name)
    if len({own, *beside}) < 1 + len(beside):
        text = f"Each robot in a simulator has a name of its own; this one is `{own}`. Give other names to `--with`."
        raise InvalidOptionError("with", text)
    if world_of is not None:
        return {"world_of": world_of}
    return {"robots": {name: {} for name in (own, *beside)}} if beside else {}


def _check_no_simulation(options: dict[str, object], *, everything: bool) -> None:
    """Raise for options of a simulated world. everything: the robot is mocked; otherwise it has no functional layer."""
    why = "`--mock` runs without one. Name the skills to mock." if everything else "this robot has none. Leave it out."
    for name, value in options.items():
        if value:
            text = f"A {name} is for a simulated robot, and {why}"
            raise InvalidOptionError(name, text)


def _existing(scenario: Path) -> str:
    if not scenario.is_file():
        text = f"There is no scenario file {scenario}. docs/sensors.md describes such files."
        raise InvalidOptionError("scenario", text)
    return str(scenario.absolute())


def _renamed(table: Robot, name: str | None) -> Robot:
    """The robot under another name, for the second one of its kind."""
    if name is None:
        return table
    require_robot_name(name)
    return replace(table, name=name)


def _check_mocks(table: Robot, mock: bool, skills: tuple[str, ...], script: Path | None) -> None:
    """Raise for options of mocks that do not fit, before any process starts."""
    if skills and not mock:
        named = " ".join(skills)
        raise InvalidOptionError("mock", f"`up {named}` names skills to mock. Write `up --mock {named}`.")
    if script is not None and not mock:
        raise InvalidOptionError("script", "A script is for mocks. Write `up --mock --script FILE`.")
    if mock:
        skillset = table.load_skillset()
        for skill in skills:
            skillset.skill(skill)
        load_scripts(scripts_for(table.skillset, script), skillset)
