"""`skillwing demo`: fly the mapping mission in simulation, lose the depth camera, finish on the LiDAR."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager, nullcontext
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

from skillwing.m600.flight_deck import FlightDeck
from skillwing.m600.robot import ROBOT
from skillwing.services.bus.clock import FollowedClock
from skillwing.services.bus.zenoh_bus import ZenohBus
from skillwing.services.commands.ending import ended_by_signals
from skillwing.services.commands.exit_codes import FAILED, OK
from skillwing.services.commands.output import make_console
from skillwing.services.errors import SkillwingError
from skillwing.services.launcher import ROUTER, Death, Launcher
from skillwing.services.robot import ProcessSpec
from skillwing.services.run_state import announced, read_run_state
from skillwing.services.telemetry.report import ProcessEntry, summary_table
from skillwing.services.telemetry.viewer_window import ViewerWindow, has_screen

MISSION = "mapping"
CAMERA_FAILS_AT = 45.0
"""Robot time in seconds: by then the drone has gone round its first obstacle and is on the second leg."""
STALL = 30.0
"""Wall seconds without robot time or news from the mission after which the flight is given up."""
LAST_WORDS = 5.0
"""Wall seconds that the recorder gets for the map and the last records."""


@dataclass
class Outcome:
    """What only the one who ran the flight knows. `ended_by`: why it was cut short, empty if the mission ended it."""

    wall_time: float = 0.0
    ended_by: str = ""
    deaths: list[Death] = field(default_factory=list)
    processes: tuple[str, ...] = ()


def demo(
    no_fault: Annotated[bool, typer.Option("--no-fault", help="Let the depth camera live.")] = False,
    fault_at: Annotated[
        float, typer.Option(metavar="SECONDS", min=0.0, help="Robot time at which the depth camera fails.")
    ] = CAMERA_FAILS_AT,
    seed: Annotated[int, typer.Option(metavar="N", min=0, help="Seed of the simulated world.")] = 1,
    speed: Annotated[float, typer.Option(metavar="FACTOR", min=0.1, help="Robot seconds per second.")] = 1.0,
    viewer: Annotated[
        bool | None, typer.Option("--viewer/--no-viewer", help="Open the Rerun viewer; default: if there is a screen.")
    ] = None,
    run_dir: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Where the run goes; default runs/TIME-mapping.")
    ] = None,
) -> None:
    """Fly the 3D-mapping mission in simulation; the depth camera fails on the way, and the LiDAR takes over.

    Writes recording, timeline, map and report to the run directory. Exit codes: 0 the mission succeeded, 1 it did
    not or was cut short.
    """
    console = make_console()
    directory = (run_dir or Path("runs") / f"{datetime.now().astimezone():%Y%m%d-%H%M%S}-{MISSION}").absolute()
    if read_run_state(ROBOT.name) is not None:
        raise SkillwingError(f"A system of `{ROBOT.name}` runs already. Stop it first with `skillwing down`.")
    faults = [] if no_fault else [{"sensor": "zed", "kind": "blackout", "at": fault_at}]
    wants_viewer = has_screen() if viewer is None else viewer
    with ViewerWindow(directory / "logs" / "viewer.log") if wants_viewer else nullcontext() as window:
        options: dict[str, Any] = {"seed": seed, "speed": speed, "faults": faults, "run_dir": str(directory)}
        if window is not None and window.is_open:
            options["viewer_url"] = window.url
        outcome = _fly(options, directory, console, _title(seed, None if no_fault else fault_at))
        code = _judge(outcome, directory, seed, console)
        if window is not None and window.is_open and sys.stdin.isatty() and not outcome.ended_by:
            console.print("Close the viewer's window, or press Ctrl-C, to end.")
            _wait_for(window)
    raise typer.Exit(code)


def _title(seed: int, fault_at: float | None) -> str:
    fault = "no fault" if fault_at is None else f"depth camera fails at {fault_at:g} s"
    return f"Mission {MISSION}, world {seed}, {fault}"


def _processes(options: dict[str, Any]) -> tuple[ProcessSpec, ...]:
    """Everything but the router and the mission; whoever only looks on is there first."""
    return (*ROBOT.observers(options), *ROBOT.functional_layer(options), *ROBOT.managers())


def _fly(options: dict[str, Any], run_dir: Path, console: Console, title: str) -> Outcome:
    """Start everything, follow the mission to its end, stop everything."""
    outcome = Outcome()
    skillset = ROBOT.load_skillset()
    specs = _processes(options)
    mission = ProcessSpec(
        "mission",
        "skillwing.bt_missions.runner:make_mission",
        {"mission": MISSION, "skillset": str(ROBOT.skillset)},
        extra="missions",
    )
    outcome.processes = (ROUTER, *(spec.name for spec in (*specs, mission)))
    essential = {ROUTER, *(spec.name for spec in (*specs, mission) if spec.essential)}
    launcher = Launcher(ROBOT.name, skillset.name, run_dir, clock=ROBOT.clock, on_death=outcome.deaths.append)
    begun = time.monotonic()
    with ended_by_signals(), _noting_interrupts(outcome), launcher:
        with console.status(f"Starting {len(outcome.processes)} processes ..."):
            launcher.start_router()
            launcher.start(specs)
        with (
            announced(ROBOT, launcher.endpoint, run_dir),
            closing(ZenohBus("demo", ROBOT.name, launcher.endpoint, FollowedClock())) as bus,
            FlightDeck(bus, skillset, console, title) as deck,
        ):
            launcher.start([mission])
            begun = time.monotonic()
            outcome.ended_by = _follow(bus, deck, outcome.deaths, essential)
            bus.run_until(lambda: False, LAST_WORDS if not outcome.ended_by else 0.5)
    outcome.wall_time = time.monotonic() - begun
    return outcome


def _follow(bus: ZenohBus, deck: FlightDeck, deaths: list[Death], essential: set[str]) -> str:
    """Wait for the mission's end; returns why it was cut short, or an empty string."""
    told: set[str] = set()
    last_news = time.monotonic()
    last_time = -1.0

    def ended_by() -> str | None:
        nonlocal last_news, last_time
        if deck.mission is not None and deck.mission.over:
            return ""
        for death in list(deaths):
            if death.process not in told:
                told.add(death.process)
                deck.tell(
                    f"{death} The mission goes on as it can." if death.process not in essential else str(death), "red"
                )
            if death.process in essential:
                return str(death)
        if bus.now() > last_time:
            last_time, last_news = bus.now(), time.monotonic()
        if time.monotonic() - last_news > STALL:
            return f"Robot time has stood still for {STALL:g} s."
        return None

    while (reason := ended_by()) is None:
        bus.run_until(lambda: False, 0.2)
    return reason


@contextmanager
def _noting_interrupts(outcome: Outcome) -> Iterator[None]:
    """Ctrl-C ends the flight, not the report."""
    try:
        yield
    except KeyboardInterrupt:
        outcome.ended_by = "Ended by Ctrl-C."


def _judge(outcome: Outcome, run_dir: Path, seed: int, console: Console) -> int:
    """Judge the run against the true world, write and print the report; returns the exit code."""
    from skillwing.m600.evaluation import evaluate  # noqa: PLC0415 - loads physics and pictures

    died = {death.process: str(death) for death in outcome.deaths}
    processes = [
        ProcessEntry(name=name, state="died" if name in died else "stopped", detail=died.get(name, ""))
        for name in outcome.processes
    ]
    with console.status("Judging the map against the true world ..."):
        report = evaluate(
            run_dir,
            ROBOT.load_skillset(),
            mission=MISSION,
            seed=seed,
            wall_time_s=outcome.wall_time,
            processes=processes,
        )
    if outcome.ended_by:
        console.print(outcome.ended_by, style="red")
    console.print(summary_table(report))
    console.print(f"Recording, pictures, report and logs: {os.path.relpath(run_dir)}")
    return OK if report.result == "success" else FAILED


def _wait_for(window: ViewerWindow) -> None:
    try:
        window.wait_until_closed()
    except KeyboardInterrupt:
        return
