"""A system run by a command: in the foreground until it is told to stop, or detached."""

from __future__ import annotations

import contextlib
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager
from functools import partial
from pathlib import Path
from queue import SimpleQueue
from typing import BinaryIO

import typer
from rich.console import Console

from skillwing.services.access.certificate_watch import CertificateWatch
from skillwing.services.access.exposure import EXPOSED, exposed
from skillwing.services.access.identity_files import require_certificates, require_router_certificate
from skillwing.services.access.robots import table_words
from skillwing.services.bus.zenoh_session import CONNECT_TIMEOUT
from skillwing.services.disk import UnwritableError, discard_unwritten, require_room
from skillwing.services.errors import InvalidOptionError, SkillwingError
from skillwing.services.history.files import TIMELINE_FILE
from skillwing.services.history.parts import part_paths
from skillwing.services.journal.journal import set_aside
from skillwing.services.names import JOURNAL_FILE
from skillwing.services.processes.child import ProcessExit
from skillwing.services.processes.colocation import colocated, process_groups
from skillwing.services.processes.launcher import ROUTER, ROUTER_TIMEOUT, START_TIMEOUT, Launcher
from skillwing.services.processes.launcher_node import LauncherNode
from skillwing.services.processes.process_state import ProcessState
from skillwing.services.processes.run_state import Announcement, announced, read_run_state, reserved, running_systems
from skillwing.services.processes.stop_signal import StopSignal, stop_on_signals
from skillwing.services.recording.run_facts import RunFacts, write_facts
from skillwing.services.robot import ProcessSpec, Robot
from skillwing.services.terminal.active_work import ActiveWork
from skillwing.services.terminal.exit_codes import FAILED, OK
from skillwing.services.terminal.foreground_supervisor import ForegroundSupervisor
from skillwing.services.terminal.link_monitor import LinkMonitor
from skillwing.services.terminal.mission_reporter import MissionReporter
from skillwing.services.terminal.output import make_console, relative_path
from skillwing.services.terminal.run_directory import claimed, make_run_dir
from skillwing.services.terminal.shared_router import consequence, objection, others_at_router, require_free_name
from skillwing.services.terminal.system_options import RunSettings
from skillwing.services.viewer.viewer import Viewer, ViewerKind

JOIN_TIMEOUT = CONNECT_TIMEOUT + 5.0
"""Longest time from the start of the processes to the announcement [s]. A router that is silent is told apart in it."""


def require_not_running(robot: str, otherwise: str = "") -> None:
    """Raise SkillwingError for a system of the robot that runs. otherwise: an alternative to stopping it."""
    running = read_run_state(robot)
    if running is not None:
        stop = f"Stop it first with `skillwing down --robot {robot}`{otherwise}."
        raise SkillwingError(f"`{robot}` runs already (process {running.pid}). {stop}")


def prepare_run(
    robot: Robot,
    specs: Sequence[ProcessSpec],
    given: Path | None,
    command: str,
    settings: RunSettings,
    *,
    detach: bool,
) -> Path:
    """Check the keys of a run, make its directory, and set the journal of an earlier run there aside.

    specs: the processes, by their names. given: the directory; None for one named after the command. detach: another
    process runs the system, and moves the journal. Raises SkillwingError, for a full disk too, InvalidOptionError, and
    KeysError.
    """
    require_not_running(robot.name, ", or give this one a name of its own with `--robot-name`")
    if settings.keys is not None:
        require_certificates(settings.keys, robot.name, (spec.name for spec in specs), partial(table_words, robot))
        if settings.router is None:
            require_router_certificate(settings.keys)
    run_dir = make_run_dir(given, command)
    require_room(run_dir)
    with claimed(run_dir):
        if settings.record and not settings.resume and part_paths(run_dir, TIMELINE_FILE):
            text = f"{relative_path(run_dir)} holds the recording of a run. Choose another directory, or `--no-record`."
            raise InvalidOptionError("run-dir", text)
        if not detach:
            _prepare_journal(run_dir, resume=settings.resume)
    return run_dir


def _prepare_journal(run_dir: Path, *, resume: bool) -> None:
    journal = run_dir / JOURNAL_FILE
    if not resume:
        set_aside(journal)
    elif not journal.is_file():
        text = f"There is no journal in {run_dir} to continue from. Name the directory of a run with --run-dir."
        raise InvalidOptionError("resume", text)


def run_system(robot: Robot, specs: Sequence[ProcessSpec], run_dir: Path, settings: RunSettings) -> int:
    """Run a system until Ctrl-C, or until it cannot go on; returns the exit code."""
    laid_out = colocated(specs) if settings.colocate else tuple(specs)
    with stop_on_signals() as stop, reserved(robot.name), claimed(run_dir):
        try:
            return _run(robot, laid_out, run_dir, settings, stop)
        finally:
            discard_unwritten()


def _run(robot: Robot, specs: tuple[ProcessSpec, ...], run_dir: Path, settings: RunSettings, stop: StopSignal) -> int:
    console = make_console(lossy=True)
    # Not when it is time for a reminder: then the robot works, and robots are imported for these words.
    table = "" if settings.keys is None else table_words(robot)
    exits: SimpleQueue[ProcessExit] = SimpleQueue()
    skillset = robot.load_skillset()
    active_work = ActiveWork(robot.name, skillset, robot.rescue_goal, simulated=settings.clock == "robot")
    launcher = Launcher(
        robot.name,
        skillset.name,
        run_dir,
        clock=settings.clock,
        topology=settings.topology,
        router=settings.router,
        keys=settings.keys,
        insecure=settings.insecure,
        restarts=True,
        stop=stop,
        on_exit=exits.put,
    )
    reporter = None
    others: dict[str, bool] = {}

    def guests() -> dict[str, bool]:
        return others_at_router(launcher.endpoint, robot.name, settings.keys) if settings.router is None else {}

    def announcement(page: str | None) -> AbstractContextManager[Announcement]:
        """The announcement, with the processes of this moment. page: of the viewer."""
        return announced(
            robot,
            launcher.endpoint,
            run_dir,
            clock=settings.clock,
            mock=settings.mock,
            topology=settings.topology,
            listens=launcher.listens,
            keys=settings.keys,
            processes=launcher.states,
            mission_context=settings.mission_context,
            viewer=page,
        )

    try:
        with ExitStack() as stack:
            with stop.raising():
                viewer = stack.enter_context(opened_viewer(settings.viewer, run_dir, console))
            observers = _observers(robot, run_dir, settings, None if viewer is None else viewer.url)
            stack.enter_context(launcher)
            if settings.router is not None:
                require_free_name(settings.router, robot.name, settings.keys, stop)
            begun = time.monotonic()
            with console.status(f"Starting {len(process_groups((*observers, *specs)))} processes ..."):
                if settings.router is None:
                    launcher.start_router(settings.listen)
                launcher.start((*observers, *specs))
            up_in = time.monotonic() - begun
            reporter = MissionReporter(run_dir, skillset.name, lambda: launcher.states) if observers else None
            certificates = CertificateWatch(settings.keys, robot.name, (spec.name for spec in specs), lambda: table)
            node = LauncherNode(launcher, robot, skillset.name, settings.mission_context, certificates)
            page = None if viewer is None else viewer.page
            supervisor = ForegroundSupervisor(
                *(console, launcher, node, lambda: announcement(page), exits, skillset.name, stop),
                reporter,
                active_work,
                objection=lambda: objection(robot.name, guests()),
                certificates=certificates,
                link=_link_of(robot.name, settings.router),
            )
            with supervisor:
                _print_start(console, robot.name, launcher, run_dir, up_in=up_in, recorded=bool(observers))
                try:
                    code = supervisor.follow()
                finally:
                    others = guests()
    except KeyboardInterrupt:
        code = OK
    console.print(f"{robot.name} has stopped.")
    if active_work.text:
        console.print(active_work.text, style="red", highlight=False)
    if others:
        console.print(consequence(others), style="red", highlight=False)
    if reporter is not None:
        with stop.raising():
            reporter.finish(console)
    return code


def _print_start(
    console: Console, robot: str, launcher: Launcher, run_dir: Path, *, up_in: float, recorded: bool
) -> None:
    """Print what runs where. up_in: seconds that the start took."""
    console.print(f"{robot} runs: {running_processes(launcher.states)} processes, up in {up_in:.1f} s.")
    where = launcher.listens or launcher.endpoint
    console.print(f"Router at {where}, {'recording' if recorded else 'logs'} in {run_dir}.")
    if exposed(where):
        console.print(EXPOSED.format(endpoint=where), style="red", highlight=False)
    which = robot_words(robot)
    console.print(f"Start a skill with `skillwing start SKILL{which}`; stop with Ctrl-C or `skillwing down{which}`.")


def _link_of(robot: str, router: str | None) -> LinkMonitor | None:
    """Monitor of the link to the router of another system; None for an own one, whose process is supervised."""
    return None if router is None else LinkMonitor(router, f"Until it does, nobody can command `{robot}`.")


@contextmanager
def opened_viewer(kind: ViewerKind, run_dir: Path, console: Console) -> Iterator[Viewer | None]:
    """A viewer of that kind; None for none, and with a sentence for one that does not open."""
    if kind == "none":
        yield None
        return
    if kind == "native":
        console.print("Opening the viewer ...")
    with Viewer(kind, run_dir / "logs" / "viewer.log") as viewer:
        if not viewer.is_open:
            log = relative_path(viewer.log)
            console.print(f"The viewer did not open; {log} has the reason. The run is recorded anyway.", style="red")
        elif viewer.page is not None:
            console.print(f"Watch it in a browser: {viewer.page}", soft_wrap=True, highlight=False)
        yield viewer if viewer.is_open else None


def _observers(robot: Robot, run_dir: Path, settings: RunSettings, viewer_url: str | None) -> tuple[ProcessSpec, ...]:
    """The recorder of a run that is recorded; the facts of the run are written at once."""
    if not settings.record:
        return ()
    facts = RunFacts(robot=robot.name, skillset=str(robot.skillset), judge=robot.judge, options=settings.options)
    try:
        write_facts(run_dir, facts)
    except OSError as error:
        raise UnwritableError(run_dir, error) from error
    place = {"run_dir": str(run_dir), "keep": settings.keep, "viewer_url": viewer_url}
    return robot.observers({**settings.options, **place})


def robot_words(robot: str) -> str:
    """Option with which a command chooses this robot: ` --robot second`. Empty if no other system runs here."""
    return f" --robot {robot}" if any(state.robot != robot for state in running_systems()) else ""


def running_processes(states: Sequence[ProcessState]) -> str:
    """`7`, or `6 of 7` after an exit; the router does not count."""
    lives = [state.life == "lives" for state in states if state.name != ROUTER]
    return f"{len(lives)}" if all(lives) else f"{sum(lives)} of {len(lives)}"


def run_detached(robot: str, words: Sequence[str], run_dir: Path) -> int:
    """Run a command line in a session of its own, and return when its system is up. It must not detach itself.

    robot: name under which the system announces itself. Returns the exit code: FAILED for a system that runs without
    one of its processes, with what is known of that process on standard error. Raises SkillwingError with the output of
    a command that ends before, or with the log file of one that takes too long.
    """
    log = run_dir / "logs" / "up.log"
    with _opened_log(log) as file:
        process = subprocess.Popen(
            [sys.executable, "-m", "skillwing.services.terminal.cli", *words, "--run-dir", str(run_dir)],
            stdin=subprocess.DEVNULL,
            stdout=file,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
    deadline = time.monotonic() + START_TIMEOUT + ROUTER_TIMEOUT + JOIN_TIMEOUT
    while time.monotonic() < deadline:
        state = read_run_state(robot)
        if state is not None and state.pid == process.pid:
            typer.echo(f"{robot} runs as process {process.pid}, logs in {run_dir}/logs.")
            typer.echo(f"`skillwing down{robot_words(robot)}` stops it.")
            if state.listens and exposed(state.listens):
                typer.secho(EXPOSED.format(endpoint=state.listens), fg="red", err=True)
            if state.viewer is not None:
                typer.echo(f"Watch it in a browser: {state.viewer}")
            return _report_failed_processes(state.processes)
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(0.05)
            require_room(run_dir)  # a full disk has no log
            raise SkillwingError(log.read_text(encoding="utf-8", errors="replace").strip() or _wordless(process, log))
    process.terminate()
    raise SkillwingError(f"`{robot}` did not come up in time. Look at {log}.")


def _opened_log(log: Path) -> BinaryIO:
    try:
        log.parent.mkdir(parents=True, exist_ok=True)
        return log.open("ab")
    except OSError as error:
        raise UnwritableError(log, error) from error


def _wordless(process: subprocess.Popen[bytes], log: Path) -> str:
    """The message for a command that has logged nothing."""
    return f"The system did not start: exit code {process.returncode}, and {log} is empty. Run it without --detach."


def _report_failed_processes(processes: Sequence[ProcessState]) -> int:
    down = [process for process in processes if process.life != "lives"]
    if not down:
        return OK
    typer.echo(f"{running_processes(processes)} processes run.", err=True)
    for process in down:
        typer.echo(process.last_words, err=True)
    return FAILED
