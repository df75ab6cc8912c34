"""`skillwing mock`: run a skillset file as a system of mocks."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from skillwing.dsl import load
from skillwing.services.mocking.script_file import load_scripts
from skillwing.services.mocking.system import mock_processes, scripts_for
from skillwing.services.processes.router import LOOPBACK
from skillwing.services.robot import Robot
from skillwing.services.terminal.journal_options import (
    DurableOption,
    ResumeOption,
    journal_words,
    make_room_for_journal,
)
from skillwing.services.terminal.output import make_console
from skillwing.services.terminal.system_options import RecordOption, ViewerOption, check_observing, observing_words
from skillwing.services.terminal.system_runner import (
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


def mock(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Skillset to mock.", show_default=False)],
    script: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="What the mocks do, besides what NAME.mock.toml beside the skillset says."),
    ] = None,
    seed: Annotated[int | None, typer.Option(metavar="N", help="Instead of the script's own seed.")] = None,
    robot_name: RobotNameOption = None,
    detach: DetachOption = False,
    colocate: ColocateOption = False,
    topology: TopologyOption = "router",
    router: RouterOption = None,
    listen: ListenOption = LOOPBACK,
    run_dir: RunDirOption = None,
    resume: ResumeOption = False,
    durable: DurableOption = False,
    record: RecordOption = True,
    viewer: ViewerOption = "none",
) -> None:
    """Run every manager of a skillset as its own process, with mocks for its skills and for the world around them.

    `start`, `interrupt`, `trigger`, `data` and the other commands work as on a robot; `script` shows and changes what
    the mocks do. docs/mocks.md tells what a script can say.

    Exit codes: 0 it was told to stop, 1 it did not start or lost a process it cannot do without, 2 broken file. With
    --detach: 0 it runs, 1 it did not start or runs without one of its processes.
    """
    skillset = load(file)
    scripts = scripts_for(file, script)
    load_scripts(scripts, skillset)
    name = robot_name or skillset.name
    require_robot_name(name)
    require_not_running(name, ", or give this one a name of its own with `--robot-name`")
    directory = make_run_dir(run_dir, "mock")
    check_observing(directory, record=record, viewer=viewer, resume=resume)
    if detach:
        words = ["mock", str(file.absolute()), "--robot-name", name, "--listen", listen]
        words += [] if script is None else ["--script", str(script.absolute())]
        words += [] if seed is None else ["--seed", str(seed)]
        words += layout_words(topology=topology, colocate=colocate, router=router)
        words += journal_words(resume=resume, durable=durable) + observing_words(record=record, viewer=viewer)
        raise typer.Exit(run_detached(name, words, directory))
    make_room_for_journal(directory, resume=resume)
    robot = Robot(name=name, skillset=file.absolute(), hooks={}, clock="wall")
    played = ", ".join(map(str, scripts)) or "no script: each skill ends with its first success, if it has one"
    make_console().print(f"Mocks of {file}. They play {played}.", markup=False)
    specs = mock_processes(robot, scripts=scripts, seed=seed, run={"run_dir": str(directory), "durable": durable})
    setting = Setting(
        clock="wall",
        listen=listen,
        mock=True,
        topology=topology,
        colocate=colocate,
        router=router,
        record=record,
        viewer=viewer,
    )
    raise typer.Exit(run_system(robot, specs, directory, setting))
