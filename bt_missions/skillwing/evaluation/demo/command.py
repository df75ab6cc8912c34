"""`skillwing demo`: fly a mission in simulation, with the failure of the paper, and judge it."""

from __future__ import annotations

import math
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager, ExitStack, closing, contextmanager, nullcontext, suppress
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Annotated, Any

import typer
import zenoh
from rich.console import Console
from rich.text import Text

from skillwing.bt_missions.running.process import mission_process
from skillwing.dsl.model import Skillset
from skillwing.evaluation.demo.flight_deck import FlightDeck
from skillwing.evaluation.demo.flight_watch import FlightWatch
from skillwing.evaluation.demo.story import CAMERA_FAILS_AT, MAPPING, Story, make_story
from skillwing.m600.robot import ROBOT
from skillwing.services.bus import Topology
from skillwing.services.bus.clock import FollowedClock
from skillwing.services.bus.zenoh_bus import ZenohBus
from skillwing.services.disk import require_room
from skillwing.services.errors import InvalidOptionError, SkillwingError
from skillwing.services.history.files import TIMELINE_FILE
from skillwing.services.history.parts import part_paths
from skillwing.services.history.report import REPORT_FILE, ProcessEntry
from skillwing.services.processes.child import ProcessExit
from skillwing.services.processes.colocation import colocated, process_groups
from skillwing.services.processes.launcher import ROUTER, Launcher, StartError
from skillwing.services.processes.run_options import LARGEST_SEED
from skillwing.services.processes.run_state import announced, reserved
from skillwing.services.processes.stop_signal import StopSignal, stop_on_signals
from skillwing.services.protocol import Keys
from skillwing.services.recording.retention import KEEP
from skillwing.services.recording.run_facts import RunFacts, write_facts
from skillwing.services.report.rendering import summary_table
from skillwing.services.robot import RECORDER, ProcessSpec
from skillwing.services.terminal.exit_codes import FAILED, INTERRUPTED, OK
from skillwing.services.terminal.mission_reporter import LAST_WORDS
from skillwing.services.terminal.output import make_console, relative_path
from skillwing.services.terminal.system_options import (
    VIEWER_HELP,
    ColocateOption,
    KeepOption,
    SpeedOption,
    TopologyOption,
    read_run_dir,
)
from skillwing.services.terminal.system_runner import opened_viewer
from skillwing.services.viewer.viewer import Viewer, ViewerKind, has_screen

CLOCK_TIMEOUT = 5.0
"""Longest wait for the simulator's first clock tick [wall s]."""
FEWER_LAST_WORDS = 0.5
"""Time for the recorder's last records after an interrupted flight [wall s]."""
TABLE_WIDTH = 100
CALLED_OFF = "Called off by Ctrl-C or a signal."
IN_AIR = "The drone was in the air; simulated, it is gone with its simulator."
UNREAD = "Stopped: the output pipe is closed."


@dataclass
class Flight:
    """Facts of a flight that its recording does not contain.

    wall_time: seconds from the beginning of robot time to the mission's end; None if it was cut short. ended_by: the
    reason for that as a sentence, empty if the mission ended by itself. started: names of the started processes. deck:
    the live display, None if the flight did not get so far.
    """

    processes: tuple[ProcessSpec, ...]
    wall_time: float | None = None
    ended_by: str = ""
    exits: list[ProcessExit] = field(default_factory=list)
    started: set[str] = field(default_factory=set)
    deck: FlightDeck | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the processes, some of which may host several nodes."""
        return (ROUTER, *(each.name for each in process_groups(self.processes)))

    @property
    def essential(self) -> frozenset[str]:
        return frozenset({ROUTER, *(each.name for each in process_groups(self.processes) if each.essential)})

    @property
    def hosts(self) -> dict[str, str]:
        """Names of the hosting processes, by node that shares a process."""
        return {spec.name: spec.host for spec in self.processes if spec.host is not None}

    def entries(self) -> list[ProcessEntry]:
        """State of each process at the end."""
        down = {exit_.process for exit_ in self.exits if exit_.final}

        def state(name: str) -> str:
            return "died" if name in down else "stopped" if name in self.started else "not started"

        def detail(name: str) -> str:
            own = [exit_ for exit_ in self.exits if exit_.process == name]
            restarts = sum(not exit_.final for exit_ in own)
            sentences = [str(own[-1])] if own else []
            sentences += [f"It was started again {restarts} time{'s' if restarts > 1 else ''}."] if restarts else []
            return " ".join(sentences)

        return [ProcessEntry(name=name, state=state(name), detail=detail(name)) for name in self.names]


def _finite(value: float | None) -> float | None:
    if value is not None and not math.isfinite(value):
        raise typer.BadParameter("give a number.")
    return value


def demo(
    mission: Annotated[
        str, typer.Argument(metavar="[MISSION]", help="Mapping, or inspection: round a building with live video.")
    ] = MAPPING,
    no_fault: Annotated[bool, typer.Option("--no-fault", help="Let the depth camera, or the link, live.")] = False,
    fault_at: Annotated[
        float | None,
        typer.Option(
            metavar="SECONDS",
            min=0.0,
            callback=_finite,
            help=f"Robot time at which the depth camera fails (default {CAMERA_FAILS_AT:g}), or the link; "
            "by default that fails behind the building.",
        ),
    ] = None,
    scenario: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="TOML or JSON: faults, wind, pilot and more, instead of the fault."),
    ] = None,
    seed: Annotated[int, typer.Option(metavar="N", min=0, max=LARGEST_SEED, help="Seed of the simulated world.")] = 1,
    speed: SpeedOption = 1.0,
    viewer: Annotated[
        ViewerKind | None, typer.Option("--viewer", help=f"{VIEWER_HELP} Default: its window, if there is a screen.")
    ] = None,
    no_viewer: Annotated[bool, typer.Option("--no-viewer", help="The same as --viewer none.")] = False,
    run_dir: Annotated[
        Path | None,
        typer.Option(metavar="DIR", parser=read_run_dir, help="Where the run goes; default runs/TIME-MISSION."),
    ] = None,
    colocate: ColocateOption = False,
    topology: TopologyOption = "router",
    keep: KeepOption = KEEP,
) -> None:
    """Run a mission in simulation. Mapping: the depth camera fails on the way, and the LiDAR takes over. Inspection:
    the radio link narrows until the video stops, and the drone lands. See docs/missions.md.

    Writes recording, timeline, map and report to the run directory.

    Exit codes: 0 the mission succeeded; 1 it failed or could not go on; 2 options that cannot be flown; 130 interrupted
    by Ctrl-C or a signal.
    """
    console = make_console()
    if no_viewer and viewer not in (None, "none"):
        raise InvalidOptionError("viewer", f"--no-viewer leaves nothing for --viewer {viewer}. Leave one of them out.")
    story = make_story(mission, seed, fault=not no_fault, fault_at=fault_at, scenario=scenario)
    title = f"Mission {mission}, world {seed}, {story.happens}"
    with reserved(ROBOT.name):
        directory = _make_run_dir(run_dir or Path("runs") / f"{datetime.now().astimezone():%Y%m%d-%H%M%S}-{mission}")
        options: dict[str, Any] = {"seed": seed, "speed": speed, "run_dir": str(directory), "keep": keep, **story.robot}
        write_facts(directory, _facts(story, seed))
        kind: ViewerKind = viewer or ("native" if has_screen() else "none")
        try:
            with stop_on_signals() as stop, ExitStack() as stack:
                with stop.raising():
                    window = stack.enter_context(opened_viewer("none" if no_viewer else kind, directory, console))
                if window is not None:
                    options["viewer_url"] = window.url
                processes = _processes(story, options)
                flight = Flight(colocated(processes) if colocate else processes)
                _fly(flight, options["speed"], directory, console, title, topology, stop)
                with stop.raising():
                    code = _judge(flight, story, directory, seed, console)
                code = INTERRUPTED if stop.received else code
                goes_on = not flight.ended_by and not stop.received
                if window is not None and window.is_open and sys.stdin.isatty() and goes_on:
                    close = "Press Ctrl-C" if window.page else "Close the viewer's window, or press Ctrl-C,"
                    console.print(f"{close} to end.")
                    _wait_for(window, stop)
        except KeyboardInterrupt:
            console.print(
                f"{CALLED_OFF} There is no report; what was recorded is in {relative_path(directory)}.", style="red"
            )
            code = INTERRUPTED
        raise typer.Exit(code)


def _make_run_dir(path: Path) -> Path:
    """Make the directory of one run; return its absolute path. Raises InvalidOptionError, and SkillwingError for a full
    disk."""
    directory = path.absolute()
    if part_paths(directory, TIMELINE_FILE) or (directory / REPORT_FILE).exists():
        raise InvalidOptionError("run_dir", f"{path} holds a run already. Choose another directory with --run-dir.")
    try:
        directory.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=directory).close()
    except OSError as error:
        message = f"Nothing can be written to {path} ({error.strerror}). Choose another directory with --run-dir."
        raise InvalidOptionError("run_dir", message) from error
    require_room(directory)
    return directory


def _facts(story: Story, seed: int) -> RunFacts:
    """Facts of the run for `skillwing report`, which judges as the demo does."""
    return RunFacts(
        robot=ROBOT.name,
        skillset=str(ROBOT.skillset),
        judge=ROBOT.judge,
        options={"seed": seed, "world": story.world, "route": story.way},
        mission=story.mission,
    )


def _processes(story: Story, options: dict[str, Any]) -> tuple[ProcessSpec, ...]:
    """All processes but the router: observers first, the mission last."""
    mission = mission_process(ROBOT, story.mission, story.options)
    return (*ROBOT.observers(options), *ROBOT.functional_layer(options), *ROBOT.managers(options), mission)


def _fly(
    flight: Flight, speed: float, run_dir: Path, console: Console, title: str, topology: Topology, stop: StopSignal
) -> None:
    """Start everything, follow the mission to its end, stop everything."""
    skillset = ROBOT.load_skillset()
    launcher = Launcher(
        ROBOT.name,
        skillset.name,
        run_dir,
        clock=ROBOT.clock,
        topology=topology,
        restarts=True,
        stop=stop,
        on_exit=flight.exits.append,
    )
    with _ending_well(flight), launcher:
        try:
            launcher.start_router()
            with announced(ROBOT, launcher.endpoint, run_dir, topology=topology) as announcement:
                launcher.on_change = lambda: announcement.update(launcher.states)
                _follow(launcher, flight, skillset, console, title, speed, stop)
        finally:
            flight.started = set(launcher.pids)


def _follow(
    launcher: Launcher,
    flight: Flight,
    skillset: Skillset,
    console: Console,
    title: str,
    speed: float,
    stop: StopSignal,
) -> None:
    """Start robot and mission, and show their events until the mission is over or cannot go on."""
    *robot, mission = flight.processes
    clock = FollowedClock()
    with closing(ZenohBus("demo", ROBOT.name, launcher.endpoint, clock)) as bus:
        with _busy(console, f"Starting {len(process_groups(flight.processes))} processes ..."):
            launcher.start(robot)
        stop.wait(bus, clock.has_started, CLOCK_TIMEOUT)
        # Robot time began before this subscription, and has run at full pace since.
        begun = time.monotonic() - (clock.now() / speed if speed > 0.0 else 0.0)
        deck = flight.deck = FlightDeck(bus, skillset, console, title)
        watch = FlightWatch(bus, Keys(skillset.name), deck, flight.exits, flight.essential, stop, hosts=flight.hosts)
        with deck:
            launcher.start([mission])
            flight.ended_by = watch.follow()
            if not flight.ended_by:
                flight.wall_time = time.monotonic() - begun
            stop.wait(bus, lambda: False, FEWER_LAST_WORDS if flight.ended_by else LAST_WORDS)


@contextmanager
def _ending_well(flight: Flight) -> Iterator[None]:
    """Note the reason for an early end in `ended_by`, so that the report is still written."""
    try:
        yield
    except KeyboardInterrupt:
        in_air = flight.deck is not None and flight.deck.in_air
        flight.ended_by = f"{CALLED_OFF} {IN_AIR}" if in_air else CALLED_OFF
    except SystemExit:
        # Rich raises it when standard output is closed, and prints nothing afterwards.
        flight.ended_by = UNREAD
    except StartError as error:
        sentences = [str(exit_) for exit_ in error.exits] or [f"No sign of life from {', '.join(error.missing)}."]
        flight.ended_by = " ".join(["The system did not start.", *sentences])
    except (SkillwingError, OSError, zenoh.ZError) as error:
        fatal = [str(exit_) for exit_ in flight.exits if exit_.final and exit_.process in flight.essential]
        flight.ended_by = " ".join(fatal) or str(error)


def _judge(flight: Flight, story: Story, run_dir: Path, seed: int, console: Console) -> int:
    """Judge the run against the true world, write and print the report; returns the exit code."""
    from skillwing.evaluation.judge.evaluation import evaluate  # noqa: PLC0415 - loads physics and pictures
    from skillwing.services.report.mission_report import UNRECORDED  # noqa: PLC0415 - loads pictures

    notes = [flight.ended_by] if flight.ended_by else []
    for note in notes:
        console.print(Text(note, "red"))
    with _busy(console, "Judging the flight against the true world ..."):
        try:
            if flight.deck is not None:
                flight.deck.complete_journal(run_dir)
            report = evaluate(
                run_dir,
                ROBOT.load_skillset(),
                mission=story.mission,
                seed=seed,
                world=story.world,
                route=story.way,
                wall_time_s=flight.wall_time,
                processes=flight.entries(),
                notes=[f"**{note}**" for note in notes],
            )
        except OSError as error:
            raise SkillwingError(f"The report cannot be written: {error}. {flight.ended_by}") from error
    for exit_ in flight.exits:
        if exit_.final and exit_.exit_code is not None and exit_.log:
            console.print(Text.assemble((f"The last lines of {exit_.process}:", "red"), *_indented(exit_.log)))
    if any(exit_.process == RECORDER and exit_.final for exit_ in flight.exits):
        console.print(Text(UNRECORDED, "red"))
    console.print(summary_table(report), width=min(console.width, TABLE_WIDTH))
    console.print(f"Recording, pictures, report and logs: {relative_path(run_dir)}")
    return OK if report.result == "success" and not flight.ended_by else FAILED


def _busy(console: Console, text: str) -> AbstractContextManager[object]:
    """Announce a long step: a spinner on a terminal, a line in a pipe."""
    if console.is_terminal:
        return console.status(text)
    console.print(text)
    return nullcontext()


def _indented(lines: tuple[str, ...]) -> Iterator[str]:
    return (f"\n    {line}" for line in lines)


def _wait_for(window: Viewer, stop: StopSignal) -> None:
    with suppress(KeyboardInterrupt), stop.raising():
        window.wait_until_closed()
