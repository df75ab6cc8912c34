"""`skillwing campaign`: fly a mission many times in simulation, and count what became of the drone."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path
from typing import Annotated

import msgspec
import typer
from rich.console import Console
from rich.text import Text

from skillwing.dsl.model import UnknownNameError
from skillwing.m600.campaign import page
from skillwing.m600.campaign.conditions import Condition, conditions_of
from skillwing.m600.campaign.crew import Crew
from skillwing.m600.campaign.flight_code import CodeChangedError, claim, flight_code
from skillwing.m600.campaign.ledger import Ledger
from skillwing.m600.campaign.outcomes import outcome_table, outcomes
from skillwing.m600.campaign.plan import FlightPlan, Network, usual_world
from skillwing.m600.campaign.result import FlightResult
from skillwing.services.cli import INTERRUPTED
from skillwing.services.commands.completion import missions
from skillwing.services.commands.exit_codes import FAILED, OK
from skillwing.services.commands.output import make_console, print_json
from skillwing.services.errors import InvalidOptionError
from skillwing.services.processes.ending import Ending, ended_by_signals

LARGEST_SEED = 2**32 - 1
MISSIONS = "skillwing.missions"


class Summary(msgspec.Struct, frozen=True, kw_only=True):
    """What `--json` prints. broken: the flights that broke a promise; command: what flies and records one again."""

    folder: str
    planned: int
    flown: int
    outcomes: list[dict[str, object]]
    broken: list[dict[str, object]]


def campaign(
    mission: Annotated[
        str, typer.Argument(metavar="MISSION", help="Mission to fly.", show_default=False, autocompletion=missions)
    ],
    seeds: Annotated[
        str, typer.Option(metavar="A:B", help="Seeds from A up to, and without, B; or one seed.")
    ] = "0:10",
    faults: Annotated[
        str, typer.Option(metavar="NAME,...", help=f"Conditions: {', '.join(Condition)}; or all.")
    ] = Condition.NONE,
    worlds: Annotated[
        str | None,
        typer.Option(metavar="KIND,...", help="Kinds of worlds; default: courtyard, or inspection for that mission."),
    ] = None,
    jobs: Annotated[
        int, typer.Option(metavar="N", min=0, help="Flights at once; 0 for one on each core, or for one over Zenoh.")
    ] = 0,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="DIR", help="Default runs/TIME-campaign-MISSION.")
    ] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Go on with the campaign in the folder.")] = False,
    record: Annotated[bool, typer.Option("--record", help="Record every flight, as `demo` does.")] = False,
    worst: Annotated[
        int, typer.Option(metavar="N", min=0, help="Fly so many of the worst flights again at the end, recorded.")
    ] = 0,
    without_obstacles: Annotated[
        bool, typer.Option("--without-obstacles", help="Take obstacle detection's word away: drones collide.")
    ] = False,
    on: Annotated[
        Network, typer.Option("--on", help="Fly in one process and virtual time, or with real processes over Zenoh.")
    ] = Network.IN_PROCESS,
    write: Annotated[
        Path | None, typer.Option("--write", metavar="FILE", help="Write the table into a page, as docs/missions.md.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON at the end, and nothing else.")] = False,
) -> None:
    """Fly a mission in many simulated worlds, much faster than real time, and count what became of the drone.

    Each flight is the robot's whole process table in one process and virtual time. What goes wrong, and when, follows
    from its seed; the same flight is the same again, bit by bit. `--on zenoh` flies the same with real processes. Each
    flight that ends is a line of `flights.jsonl`, so that a campaign that was ended goes on by `--resume`. Exit codes:
    0 every promise was kept (nothing hit, fence kept, landed or handed over), 1 one was broken, 2 it cannot be flown
    with these options, 130 it was called off.
    """
    plans = make_plans(mission, seeds, faults, worlds, watched=not without_obstacles, network=on)
    title = mission + (" without obstacle detection" if without_obstacles else "")
    title += " over Zenoh" if on is Network.ZENOH else ""
    if write is not None:
        page.check(write, title)
    at_once = jobs or (1 if on is Network.ZENOH else os.cpu_count() or 1)
    folder = output or Path("runs") / f"{datetime.now().astimezone():%Y%m%d-%H%M%S}-campaign-{mission}"
    console = make_console()
    ledger = Ledger(folder, resume=resume)
    code = flight_code()
    claim(folder, code, begun=bool(ledger.results))
    shown = Console(quiet=True) if as_json else console
    called_off = False
    with ended_by_signals() as ending:
        try:
            _fly(plans, ledger, at_once, record=record, console=shown, ending=ending)
            _record_worst(ledger, worst, at_once, shown, ending)
        except KeyboardInterrupt:
            called_off = True
            shown.print("Called off. Go on with --resume.", style="red")
        finally:
            ledger.close()
    _tell(plans, ledger, console, as_json=as_json)
    if write is not None and not called_off and ledger.results:
        rows = outcomes(ledger.results)
        if changes := flight_code().changes(code):
            raise CodeChangedError(changes, "The page is left as it was. Fly anew, with another folder for --output.")
        page.write(write, title, page.section(title.capitalize(), _words(), ledger.results, rows, code.digest))
    kept = all(result.kept for result in ledger.results)
    raise typer.Exit(FAILED if not kept else INTERRUPTED if called_off else OK)


# --- what is flown ---------------------------------------------------------------------------------------------------


def make_plans(
    mission: str,
    seeds: str,
    conditions: str,
    worlds: str | None,
    *,
    watched: bool = True,
    network: Network = Network.IN_PROCESS,
) -> list[FlightPlan]:
    """All flights of a campaign, seed by seed, so that one that is cut short has flown all conditions alike.

    Raises UnknownNameError and InvalidOptionError.
    """
    from importlib.metadata import entry_points  # noqa: PLC0415

    from skillwing.sim_mujoco.world.kinds import KINDS  # noqa: PLC0415 - loads numpy

    missions = entry_points(group=MISSIONS).names
    if mission not in missions:
        raise UnknownNameError("mission", mission, sorted(missions))
    names = conditions_of(mission) if conditions == "all" else _names("condition", conditions, list(Condition))
    kinds = list(KINDS) if worlds == "all" else _names("world", worlds or usual_world(mission), list(KINDS))
    plans = [
        FlightPlan(mission=mission, world=kind, seed=seed, condition=Condition(name), watched=watched, network=network)
        for seed in parse_seeds(seeds)
        for kind in kinds
        for name in names
    ]
    for first in plans[: len(kinds) * len(names)]:
        first.mission_options()  # where a mission has nothing to do is said before anything flies
    return plans


def parse_seeds(text: str) -> range:
    """Seeds from `A:B`, or one. Raises InvalidOptionError."""
    first, colon, end = text.partition(":")
    if not (first.isdecimal() and (end.isdecimal() if colon else not end)):
        raise InvalidOptionError("seeds", f"`{text}` are no seeds. Write `0:100` for 0 to 99, or one number.")
    seeds = range(int(first), int(end) if colon else int(first) + 1)
    if not seeds or seeds[-1] > LARGEST_SEED:
        raise InvalidOptionError("seeds", f"`{text}` holds no seed. Write `A:B` with A below B, up to {LARGEST_SEED}.")
    return seeds


def _names(what: str, text: str, known: Sequence[str]) -> list[str]:
    """Names that commas separate, each once. Raises UnknownNameError."""
    names = list(dict.fromkeys(name.strip() for name in text.split(",") if name.strip()))
    for name in names or [text]:
        if name not in known:
            raise UnknownNameError(what, name, known)
    return names


# --- flying ----------------------------------------------------------------------------------------------------------


def _fly(
    plans: Sequence[FlightPlan], ledger: Ledger, jobs: int, *, record: bool, console: Console, ending: Ending
) -> None:
    flown = {result.plan.name for result in ledger.results}
    missing = [plan for plan in plans if plan.name not in flown]
    console.print(f"{len(missing)} flights, {min(jobs, len(missing)) or 1} at once; results go to {ledger.folder}.")
    begun = time.monotonic()

    def run_dir(plan: FlightPlan) -> Path | None:
        return _run_dir(ledger.folder, plan) if record else None

    with Crew(jobs) as crew:
        for count, result in enumerate(crew.fly(missing, run_dir, ending.look), start=1):
            ledger.add(result)
            left = (time.monotonic() - begun) / count * (len(missing) - count)
            console.print(_line(result, f"{count}/{len(missing)}", left), soft_wrap=True)


def _record_worst(ledger: Ledger, count: int, jobs: int, console: Console, ending: Ending) -> None:
    """Fly the worst flights again with the recorder; a broken promise has to break again."""
    worst = sorted(ledger.results, key=lambda result: result.badness, reverse=True)[:count]
    plans = [each.plan for each in worst if not (ledger.folder / each.plan.name).exists()]
    if not plans:
        return
    console.print(f"Flying the {len(plans)} worst flights again, recorded.")
    with Crew(jobs) as crew:
        for result in crew.fly(plans, lambda plan: _run_dir(ledger.folder, plan), ending.look):
            console.print(f"  {ledger.folder / result.plan.name}")


def _run_dir(folder: Path, plan: FlightPlan) -> Path:
    directory = (folder / plan.name).absolute()
    directory.mkdir(parents=True, exist_ok=True)
    return directory


# --- telling ---------------------------------------------------------------------------------------------------------


def _line(result: FlightResult, count: str, left: float) -> Text:
    plan = result.plan
    clearance = "" if result.clearance is None else f"{result.clearance:.2f} m"
    mapped = "" if result.coverage is None else f"{100 * result.coverage:.0f} %"
    text = Text(f"{count:>7} {plan.world} {plan.condition} {plan.seed}".ljust(34))
    text.append(f"{result.end:17}", "" if result.kept else "red")
    text.append("done   " if result.succeeded else "failed ", "green" if result.succeeded else "yellow")
    text.append(f"{clearance:>7}{mapped:>5}{result.end_time:6.0f} s", "dim")
    text.append(f"  {_duration(left)} left", "dim")
    if not result.kept:
        text.append(f"\n        {', '.join(result.broken)}\n        {plan.command}", "red")
    return text


def _duration(seconds: float) -> str:
    minutes = round(seconds / 60.0)
    return f"{minutes // 60} h {minutes % 60:02} min" if minutes >= 60 else f"{minutes} min"


def _tell(plans: Sequence[FlightPlan], ledger: Ledger, console: Console, *, as_json: bool) -> None:
    rows = outcomes(ledger.results)
    if as_json:
        broken: list[dict[str, object]] = [
            {**msgspec.to_builtins(result), "broken": result.broken, "command": result.plan.command}
            for result in ledger.results
            if not result.kept
        ]
        print_json(
            Summary(
                folder=str(ledger.folder),
                planned=len(plans),
                flown=len(ledger.results),
                outcomes=[msgspec.to_builtins(row) for row in rows],
                broken=broken,
            )
        )
    elif rows:
        console.print()
        console.print(outcome_table(rows))


def _words() -> list[str]:
    """The command that was given, as it is to be given again: into a new folder."""
    words, kept = iter(sys.argv[1:]), ["skillwing"]
    for word in words:
        if word in ("-o", "--output"):
            next(words, None)
        elif word != "--resume" and not word.startswith("--output="):
            kept.append(word)
    return kept
