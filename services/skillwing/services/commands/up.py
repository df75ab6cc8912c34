"""`skillwing up`: start a robot's processes and stay with them, or leave them to themselves."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer

from skillwing.services.commands.completion import robots, skills
from skillwing.services.commands.journal_options import (
    DurableOption,
    ResumeOption,
    journal_words,
    make_room_for_journal,
)
from skillwing.services.commands.observing import RecordOption, ViewerOption, check_observing, observing_words
from skillwing.services.commands.pace import PaceOption, written_pace
from skillwing.services.commands.running import (
    ColocateOption,
    DetachOption,
    ListenOption,
    RobotNameOption,
    RouterOption,
    RunDirOption,
    Setting,
    TopologyOption,
    layout_words,
    make_run_dir,
    require_not_running,
    require_robot_name,
    run_detached,
    run_system,
)
from skillwing.services.errors import InvalidOptionError
from skillwing.services.mocking.script_file import load_scripts
from skillwing.services.mocking.system import mock_processes, scripts_for
from skillwing.services.processes.router import LOOPBACK
from skillwing.services.processes.run_options import LARGEST_SEED
from skillwing.services.robot import Robot, find_robot

WORLD_SEED = 1


def up(
    mocked: Annotated[
        list[str] | None,
        typer.Argument(metavar="SKILL", help="With --mock: the skills to mock, default all.", autocompletion=skills),
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
    speed: PaceOption = 1.0,
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
        typer.Option(metavar="KIND", help="Of simulated world, default courtyard; `skillwing world` lists them."),
    ] = None,
    mock: Annotated[
        bool, typer.Option("--mock", help="Mock skills: all of them without a robot, or those named.")
    ] = False,
    script: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="What mocks do, besides what NAME.mock.toml beside the skillset says."),
    ] = None,
    scenario: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="What befalls a simulated robot: faults, wind and more (docs/sensors.md)."),
    ] = None,
    detach: DetachOption = False,
    colocate: ColocateOption = False,
    topology: TopologyOption = "router",
    router: RouterOption = None,
    robot_name: RobotNameOption = None,
    listen: ListenOption = LOOPBACK,
    run_dir: RunDirOption = None,
    resume: ResumeOption = False,
    durable: DurableOption = False,
    record: RecordOption = True,
    viewer: ViewerOption = "none",
) -> None:
    """Start a robot's processes and stay with them until Ctrl-C.

    All that happens is recorded in the run's directory, and each mission that is flown leaves a report there.

    With --mock no robot is needed: all of its skills are mocked, and the world around them. `up --mock goto hover`
    mocks these skills only; the others, and the robot, are real.

    Several robots may share one router, each in a namespace of its name: `up --robot-name second --router
    tcp/127.0.0.1:PORT`. Their commands take `--robot second` then.

    With --resume the resource manager goes on from the journal of an earlier run: states, goals and tokens are those
    of then. That makes sense where the robot has lived on meanwhile; a simulated one has not.

    Exit codes: 0 it was told to stop, 1 it did not start or lost a process it cannot do without, 2 unknown robot. With
    --detach: 0 it runs, 1 it did not start or runs without one of its processes.
    """
    table = _called(find_robot(robot), robot_name)
    skills = tuple(dict.fromkeys(mocked or ()))
    _check_mocks(table, mock, skills, script)
    everything = mock and not skills
    _check_world(world, robotless=everything)
    _check_scenario(scenario, robotless=everything)
    run: dict[str, Any] = {"seed": WORLD_SEED if seed is None else seed, "speed": speed, "durable": durable}
    run |= {} if world is None else {"world": world}
    run |= {} if scenario is None else {"scenario": str(scenario.absolute())}
    table.check(run)
    known = table.brief(run)
    require_not_running(table.name, ", or give this one a name of its own with `--robot-name`")
    directory = make_run_dir(run_dir, "up")
    check_observing(directory, record=record, viewer=viewer, resume=resume)
    if detach:
        # Not the words we were called with: any of them, such as `-dr`, might say --detach once more.
        words = ["up", *skills, "--robot", robot, "--speed", written_pace(speed), "--listen", listen]
        words += [] if robot_name is None else ["--robot-name", robot_name]
        words += [] if seed is None else ["--seed", str(seed)]
        words += [] if world is None else ["--world", world]
        words += ["--mock"] if mock else []
        words += [] if script is None else ["--script", str(script.absolute())]
        words += [] if scenario is None else ["--scenario", str(scenario.absolute())]
        words += layout_words(topology=topology, colocate=colocate, router=router)
        words += journal_words(resume=resume, durable=durable) + observing_words(record=record, viewer=viewer)
        raise typer.Exit(run_detached(table.name, words, directory))
    make_room_for_journal(directory, resume=resume)
    run["run_dir"] = str(directory)
    layer = () if everything else table.functional_layer(run)
    managers = (
        mock_processes(table, scripts=scripts_for(table.skillset, script), seed=seed, skills=skills or None, run=run)
        if mock
        else table.managers(run)
    )
    clock = "wall" if everything else table.clock
    setting = Setting(
        clock=clock,
        listen=listen,
        mock=everything,
        topology=topology,
        colocate=colocate,
        router=router,
        briefing=known,
        record=record,
        options={} if everything else run,
        viewer=viewer,
    )
    ran = Robot(table.name, table.skillset, table.hooks, clock="wall") if everything else table
    raise typer.Exit(run_system(ran, (*layer, *managers), directory, setting))


def _check_world(world: str | None, *, robotless: bool) -> None:
    """Which worlds there are, the robot knows best."""
    if world is not None and robotless:
        text = "A world is for a simulated robot, and `--mock` runs without one. Mock some skills only, by their names."
        raise InvalidOptionError("world", text)


def _check_scenario(scenario: Path | None, *, robotless: bool) -> None:
    """What is in it, the robot's own check knows best."""
    if scenario is None:
        return
    if robotless:
        text = (
            "A scenario is for a simulated robot, and `--mock` runs without one. Mock some skills only, by their names."
        )
        raise InvalidOptionError("scenario", text)
    if not scenario.is_file():
        raise InvalidOptionError(
            "scenario", f"There is no scenario file {scenario}. docs/sensors.md describes the format."
        )


def _called(table: Robot, name: str | None) -> Robot:
    """The robot under the name that it is to have, for the second one of its kind."""
    if name is None:
        return table
    require_robot_name(name)
    return replace(table, name=name)


def _check_mocks(table: Robot, mock: bool, skills: tuple[str, ...], script: Path | None) -> None:
    """Say what is wrong with what is to be mocked, before any process starts."""
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
