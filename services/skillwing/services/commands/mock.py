"""`skillwing mock`: a skillset file run as a system of mocks."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from skillwing.dsl import load
from skillwing.services.mocking.script_file import load_scripts
from skillwing.services.mocking.system import mock_processes, scripts_for
from skillwing.services.processes.router import LOOPBACK
from skillwing.services.recording.retention import KEEP
from skillwing.services.robot import Robot
from skillwing.services.terminal.output import make_console
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
    TopologyOption,
    ViewerOption,
    require_robot_name,
)
from skillwing.services.terminal.system_runner import prepare_run, run_detached, run_system


def mock(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Skillset to mock.", show_default=False)],
    script: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Script of the mocks, in addition to NAME.mock.toml beside the skillset."),
    ] = None,
    seed: Annotated[int | None, typer.Option(metavar="N", help="Seed that replaces the script's.")] = None,
    robot_name: RobotNameOption = None,
    detach: DetachOption = False,
    colocate: ColocateOption = False,
    topology: TopologyOption = "router",
    router: RouterOption = None,
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
    """Run any skillset file without a robot: a process for each manager, with mocks for its skills and its world.

    `start`, `interrupt`, `trigger`, `data` and the other commands work as on a robot; `script` shows and changes what
    the mocks do. See docs/mocks.md.

    Exit codes: 0 it was told to stop, 1 it did not start or lost an essential process, 2 broken file, wrong options or
    keys. With --detach: 0 it runs, 1 it did not start or runs without one of its processes.
    """
    skillset = load(file)
    scripts = scripts_for(file, script)
    load_scripts(scripts, skillset)
    name = robot_name or skillset.name
    require_robot_name(name)
    settings = RunSettings(
        clock="wall",
        listen=listen,
        mock=True,
        topology=topology,
        colocate=colocate,
        router=router,
        resume=resume,
        durable=durable,
        record=record,
        keep=keep,
        viewer=viewer,
        keys=keys,
        insecure=insecure,
    )
    robot = Robot(name=name, skillset=file.absolute(), hooks={}, clock="wall")
    make_processes = partial(mock_processes, robot, scripts=scripts, seed=seed)
    directory = prepare_run(robot, make_processes(), run_dir, "mock", settings, detach=detach)
    if detach:
        words = ["mock", str(file.absolute()), "--robot-name", name, *settings.words()]
        words += [] if script is None else ["--script", str(script.absolute())]
        words += [] if seed is None else ["--seed", str(seed)]
        raise typer.Exit(run_detached(name, words, directory))
    played = ", ".join(map(str, scripts)) or "no script: each skill ends with its first success, if it has one"
    make_console().print(f"Mocks of {file}. They play {played}.", markup=False)
    run = {"run_dir": str(directory), "durable": durable, "keep": keep}
    raise typer.Exit(run_system(robot, make_processes(run=run), directory, settings))
