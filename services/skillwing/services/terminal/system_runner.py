"""Running a system of processes from a command: in the foreground until it is told to stop, or detached."""

from __future__ import annotations

import contextlib
import re
import subprocess
import sys
import time
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from queue import SimpleQueue
from typing import Annotated, Any

import typer

from skillwing.services.bus import Topology
from skillwing.services.errors import InvalidOptionError, SkillwingError
from skillwing.services.processes.colocation import colocated, households
from skillwing.services.processes.launcher import ROUTER, ROUTER_TIMEOUT, START_TIMEOUT, Death, Launcher
from skillwing.services.processes.process_state import ProcessState
from skillwing.services.processes.router import LOOPBACK
from skillwing.services.processes.run_state import announced, read_run_state, reserved
from skillwing.services.processes.stop_signal import Ending, ended_by_signals
from skillwing.services.recording.run_facts import RunFacts, write_facts
from skillwing.services.robot import ClockKind, ProcessSpec, Robot
from skillwing.services.terminal.active_work import Unfinished
from skillwing.services.terminal.exit_codes import FAILED, OK
from skillwing.services.terminal.foreground_supervisor import Attendance
from skillwing.services.terminal.mission_reporter import FlightReports
from skillwing.services.terminal.output import make_console
from skillwing.services.terminal.system_options import opened_viewer
from skillwing.services.viewer.viewer import ViewerKind

DetachOption = Annotated[bool, typer.Option("--detach", "-d", help="Return once it runs; `down` stops it.")]
ListenOption = Annotated[str, typer.Option("--listen", metavar="tcp/HOST:PORT", help="Where the router listens.")]
RunDirOption = Annotated[
    Path | None, typer.Option("--run-dir", metavar="DIR", help="Where logs go; default runs/TIME.", show_default=False)
]

TopologyOption = Annotated[
    Topology,
    typer.Option(
        "--topology",
        help="How processes meet: all at the router, or each with each, for the lowest latency on one host.",
    ),
]
ColocateOption = Annotated[
    bool, typer.Option("--colocate", help="All managers but the resource manager in one process, for small machines.")
]

RouterOption = Annotated[
    str | None,
    typer.Option(
        "--router", metavar="tcp/HOST:PORT", help="Share the router of a system that runs, instead of starting one."
    ),
]
RobotNameOption = Annotated[
    str | None,
    typer.Option("--robot-name", metavar="NAME", help="What to call this robot, of which others may run here."),
]
NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]*")


def require_robot_name(name: str) -> None:
    """Raise InvalidOptionError for what is no name of a robot, which is a part of keys and of file names."""
    if not NAME.fullmatch(name):
        raise InvalidOptionError("robot-name", f"A robot cannot be called `{name}`. Use letters, digits, `_` and `-`.")


def make_run_dir(given: Path | None, command: str) -> Path:
    """The directory of a run, called after the time and the command unless given."""
    return (given or Path("runs") / f"{datetime.now().astimezone():%Y%m%d-%H%M%S}-{command}").absolute()


def require_not_running(robot: str, otherwise: str = "") -> None:
    """Raise SkillwingError if a system of the robot runs already. otherwise: what to do instead of stopping that."""
    running = read_run_state(robot)
    if running is not None:
        stop = f"Stop it first with `skillwing down --robot {robot}`{otherwise}."
        raise SkillwingError(f"`{robot}` runs already (process {running.pid}). {stop}")


def layout_words(*, topology: Topology, colocate: bool, router: str | None) -> list[str]:
    """The options of a command line that say how processes are laid out."""
    shared = [] if router is None else ["--router", router]
    return ["--topology", topology, *(["--colocate"] if colocate else []), *shared]


@dataclass(frozen=True, kw_only=True)
class Setting:
    """How to run a system. clock: who tells robot time; listen: where its router does; mock: nothing in it is real.

    topology, colocate: how processes meet, and whether managers share one; router: where somebody else's is.
    briefing: what missions are told of the place, by mission. record: what happens is written down, for a run with
    these options; viewer: where it is shown.
    """

    clock: ClockKind
    listen: str
    mock: bool
    topology: Topology = "router"
    colocate: bool = False
    router: str | None = None
    briefing: dict[str, dict[str, Any]] = field(default_factory=dict[str, dict[str, Any]])
    record: bool = False
    options: dict[str, Any] = field(default_factory=dict[str, Any])
    viewer: ViewerKind = "none"

    def __post_init__(self) -> None:
        if self.router is not None and self.listen != LOOPBACK:
            raise InvalidOptionError(
                "listen", "A router that runs already listens where it does. Leave out `--listen`."
            )


def run_system(robot: Robot, specs: Sequence[ProcessSpec], run_dir: Path, setting: Setting) -> int:
    """Run a system until Ctrl-C, or until it cannot go on; returns the exit code."""
    laid_out = colocated(specs) if setting.colocate else tuple(specs)
    with ended_by_signals() as ending, reserved(robot.name):
        return _run(robot, laid_out, run_dir, setting, ending)


def _run(robot: Robot, specs: tuple[ProcessSpec, ...], run_dir: Path, setting: Setting, ending: Ending) -> int:
    console = make_console()
    deaths: SimpleQueue[Death] = SimpleQueue()
    skillset = robot.load_skillset()
    unfinished = Unfinished(robot.name, skillset, robot.not_to_be_left, simulated=setting.clock == "robot")
    launcher = Launcher(
        robot.name,
        skillset.name,
        run_dir,
        clock=setting.clock,
        topology=setting.topology,
        router=setting.router,
        restarts=True,
        ending=ending,
        on_death=deaths.put,
    )
    reports = None
    try:
        with ExitStack() as stack:
            with ending.at_once():
                viewer = stack.enter_context(opened_viewer(setting.viewer, run_dir, console))
            observers = _observers(robot, run_dir, setting, None if viewer is None else viewer.url)
            stack.enter_context(launcher)
            begun = time.monotonic()
            with console.status(f"Starting {len(households((*observers, *specs)))} processes ..."):
                if setting.router is None:
                    launcher.start_router(setting.listen)
                launcher.start((*observers, *specs))
            with announced(
                robot,
                launcher.endpoint,
                run_dir,
                clock=setting.clock,
                mock=setting.mock,
                topology=setting.topology,
                processes=launcher.states,
                briefing=setting.briefing,
                viewer=None if viewer is None else viewer.page,
            ) as announcement:
                count, seconds = how_many_run(launcher.states), time.monotonic() - begun
                console.print(f"{robot.name} runs: {count} processes, up in {seconds:.1f} s.")
                console.print(f"Router at {launcher.endpoint}, {'recording' if observers else 'logs'} in {run_dir}.")
                console.print("Start a skill with `skillwing start SKILL`; stop with Ctrl-C or `skillwing down`.")
                reports = FlightReports(run_dir, skillset.name, lambda: launcher.states) if observers else None
                attendance = Attendance(
                    console, launcher, announcement, deaths, skillset.name, ending, reports, unfinished
                )
                with attendance:
                    code = attendance.follow()
    except KeyboardInterrupt:
        code = OK
    console.print(f"{robot.name} has stopped.")
    if unfinished.words:
        console.print(unfinished.words, style="red", highlight=False)
    if reports is not None:
        with ending.at_once():
            reports.finish(console)
    return code


def _observers(robot: Robot, run_dir: Path, setting: Setting, viewer_url: str | None) -> tuple[ProcessSpec, ...]:
    """Who writes the run down, if it is to be, and the facts that are known of it beforehand."""
    if not setting.record:
        return ()
    facts = RunFacts(robot=robot.name, skillset=str(robot.skillset), judge=robot.judge, options=setting.options)
    write_facts(run_dir, facts)
    return robot.observers({**setting.options, "run_dir": str(run_dir), "viewer_url": viewer_url})


def how_many_run(states: Sequence[ProcessState]) -> str:
    """`7`, or `6 of 7` where one has died; the router is none of them."""
    lives = [state.life == "lives" for state in states if state.name != ROUTER]
    return f"{len(lives)}" if all(lives) else f"{sum(lives)} of {len(lives)}"


def run_detached(robot: str, words: Sequence[str], run_dir: Path) -> int:
    """Run a command line, which must not detach itself, in a session of its own; return when its system is up.

    robot: the name under which the system makes itself known. Returns the exit code: that of a failure where a process
    is down that the system can do without, with what is known of it on standard error. Raises SkillwingError with what
    the command said if it ends before, or with where to look if it does not come up in time.
    """
    log = run_dir / "logs" / "up.log"
    log.parent.mkdir(parents=True, exist_ok=True)
    with log.open("ab") as file:
        process = subprocess.Popen(
            [sys.executable, "-m", "skillwing.services.terminal.cli", *words, "--run-dir", str(run_dir)],
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
            if state.viewer is not None:
                typer.echo(f"Watch it in a browser: {state.viewer}")
            return _tell_what_is_down(state.processes)
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(0.05)
            raise SkillwingError(log.read_text(encoding="utf-8", errors="replace").strip())
    process.terminate()
    raise SkillwingError(f"`{robot}` did not come up in time. Look at {log}.")


def _tell_what_is_down(processes: Sequence[ProcessState]) -> int:
    down = [process for process in processes if process.life != "lives"]
    if not down:
        return OK
    typer.echo(f"{how_many_run(processes)} processes run.", err=True)
    for process in down:
        typer.echo(process.last_words, err=True)
    return FAILED
