"""`skillwing up`: start a robot's processes and stay with them, or leave them to themselves."""

from __future__ import annotations

import contextlib
import subprocess
import sys
import time
from datetime import datetime
from pathlib import Path
from queue import SimpleQueue
from typing import Annotated

import typer
from rich.console import Console

from skillwing.services.commands.ending import ended_by_signals
from skillwing.services.commands.exit_codes import FAILED, OK
from skillwing.services.commands.output import make_console
from skillwing.services.errors import SkillwingError
from skillwing.services.processes.launcher import ROUTER, ROUTER_TIMEOUT, START_TIMEOUT, Death, Launcher
from skillwing.services.processes.mock_host import mock_processes
from skillwing.services.processes.router import LOOPBACK
from skillwing.services.processes.run_state import announced, read_run_state, reserved
from skillwing.services.robot import ClockKind, ProcessSpec, Robot, find_robot


def up(
    robot: Annotated[str, typer.Option("--robot", "-r", metavar="NAME", help="Robot to run.")] = "m600",
    speed: Annotated[float, typer.Option(metavar="FACTOR", min=0.05, help="Robot seconds per second.")] = 1.0,
    seed: Annotated[int, typer.Option(metavar="N", min=0, help="Seed of the simulated world.")] = 1,
    mock: Annotated[bool, typer.Option("--mock", help="No robot: mocked skills that end well after a second.")] = False,
    detach: Annotated[bool, typer.Option("--detach", "-d", help="Return once it runs; `down` stops it.")] = False,
    listen: Annotated[str, typer.Option(metavar="tcp/HOST:PORT", help="Where the router listens.")] = LOOPBACK,
    run_dir: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Where logs go; default runs/TIME-up.", show_default=False)
    ] = None,
) -> None:
    """Start a robot's processes and stay with them until Ctrl-C.

    Exit codes: 0 it was told to stop, 1 it did not start or lost a process it cannot do without, 2 unknown robot.
    """
    table = find_robot(robot)
    running = read_run_state(robot)
    if running is not None:
        raise SkillwingError(f"`{robot}` runs already (process {running.pid}). Stop it first with `skillwing down`.")
    directory = (run_dir or Path("runs") / f"{datetime.now().astimezone():%Y%m%d-%H%M%S}-up").absolute()
    if detach:
        # Not the words we were called with: any of them, such as `-dr`, might say --detach once more.
        words = ["--robot", robot, "--speed", str(speed), "--seed", str(seed), "--listen", listen]
        _detach(robot, [*words, *(["--mock"] if mock else [])], directory)
        return
    options = {"seed": seed, "speed": speed, "run_dir": str(directory)}
    clock: ClockKind = "wall" if mock else table.clock
    specs = mock_processes(table) if mock else (*table.functional_layer(options), *table.managers())
    with ended_by_signals(), reserved(robot):
        code = _run(table, specs, directory, clock, listen, mock)
    raise typer.Exit(code)


def _run(robot: Robot, specs: tuple[ProcessSpec, ...], run_dir: Path, clock: ClockKind, listen: str, mock: bool) -> int:
    """Run a system until Ctrl-C, or until it cannot go on; returns the exit code."""
    console = make_console()
    deaths: SimpleQueue[Death] = SimpleQueue()
    launcher = Launcher(robot.name, robot.load_skillset().name, run_dir, clock=clock, on_death=deaths.put)
    try:
        with launcher:
            begun = time.monotonic()
            with console.status(f"Starting {len(specs)} processes ..."):
                launcher.start_router(listen)
                launcher.start(specs)
            with announced(robot, launcher.endpoint, run_dir, clock=clock, mock=mock):
                console.print(f"{robot.name} runs: {len(specs)} processes, up in {time.monotonic() - begun:.1f} s.")
                console.print(f"Router at {launcher.endpoint}, logs in {run_dir}/logs.")
                console.print("Start a skill with `skillwing start SKILL`; stop with Ctrl-C or `skillwing down`.")
                code = _watch(console, deaths, {spec.name for spec in specs if spec.essential} | {ROUTER})
    except KeyboardInterrupt:
        code = OK
    console.print(f"{robot.name} has stopped.")
    return code


def _watch(console: Console, deaths: SimpleQueue[Death], essential: set[str]) -> int:
    """Report deaths until one of them is the end of the system."""
    while True:
        death = deaths.get()
        console.print(str(death), style="red")
        if death.process in essential:
            console.print("The system cannot go on without it.")
            for line in death.log:
                console.print(f"    {line}", markup=False)
            return FAILED


def _detach(robot: str, options: list[str], run_dir: Path) -> None:
    """Run `up` with these options in a session of its own; return when the system is up."""
    log = run_dir / "logs" / "up.log"
    log.parent.mkdir(parents=True, exist_ok=True)
    with log.open("ab") as file:
        process = subprocess.Popen(
            [sys.executable, "-m", "skillwing.services.cli", "up", *options, "--run-dir", str(run_dir)],
            stdin=subprocess.DEVNULL,
            stdout=file,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
    deadline = time.monotonic() + START_TIMEOUT + ROUTER_TIMEOUT
    while time.monotonic() < deadline:
        state = read_run_state(robot)
        if state is not None and state.pid == process.pid:
            typer.echo(f"{robot} runs as process {process.pid}, logs in {run_dir}/logs. `skillwing down` stops it.")
            return
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(0.05)
            raise SkillwingError(log.read_text(encoding="utf-8", errors="replace").strip())
    process.terminate()
    raise SkillwingError(f"`{robot}` did not come up in time. Look at {log}.")
