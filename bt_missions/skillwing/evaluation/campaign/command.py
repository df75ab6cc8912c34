"""`skillwing campaign`: fly a mission many times in simulation, and count how the flights end."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from contextlib import closing
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.text import Text

from skillwing.dsl.model import UnknownNameError
from skillwing.evaluation.campaign import page
from skillwing.evaluation.campaign.flight_code import FlightCode, FlyingCode, claim
from skillwing.evaluation.campaign.ledger import CampaignLedger
from skillwing.evaluation.campaign.outcomes import outcomes, worst_of
from skillwing.evaluation.campaign.output import CampaignState, command_words, flight_line, print_summary, show_summary
from skillwing.evaluation.campaign.recordings import begin_recording, is_recorded, keep_recording
from skillwing.evaluation.campaign.rerun import comparison, same_flight, take_sample
from skillwing.evaluation.campaign.worker_pool import FlightPool, LostFlight, WorkerPool
from skillwing.evaluation.flights.conditions import Condition, conditions_of
from skillwing.evaluation.flights.plan import FlightNetwork, FlightPlan, usual_world
from skillwing.services.errors import InvalidOptionError
from skillwing.services.processes.run_options import LARGEST_SEED
from skillwing.services.processes.stop_signal import StopSignal, stop_on_signals
from skillwing.services.terminal.completion import missions
from skillwing.services.terminal.doc_sections import PageError
from skillwing.services.terminal.exit_codes import FAILED, INTERRUPTED, OK
from skillwing.services.terminal.output import make_console

SEEDS = "0:10"
"""Default seeds."""
MOST_FLIGHTS = 100_000
"""Largest number of flights: more would take weeks of processor time, and hint at a typing error."""
MISSIONS = "skillwing.missions"


def campaign(
    mission: Annotated[
        str, typer.Argument(metavar="MISSION", help="Mission to fly.", show_default=False, autocompletion=missions)
    ],
    seeds: Annotated[
        str | None,
        typer.Option(metavar="A:B", help=f"Seeds from A up to, and without, B; or one seed. Default {SEEDS}."),
    ] = None,
    faults: Annotated[
        str | None,
        typer.Option(metavar="NAME,...", help=f"Conditions: {', '.join(Condition)}; or all. Default {Condition.NONE}."),
    ] = None,
    worlds: Annotated[
        str | None,
        typer.Option(metavar="KIND,...", help="Kinds of worlds; default: courtyard, or inspection for that mission."),
    ] = None,
    jobs: Annotated[
        int, typer.Option(metavar="N", min=0, help="Flights at once; 0 for one on each core, or for one over Zenoh.")
    ] = 0,
    cluster: Annotated[
        str | None,
        typer.Option(
            "--cluster", metavar="ADDRESS", help="Fly on the workers of a Dask scheduler, as tcp://HOST:8786."
        ),
    ] = None,
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
        FlightNetwork,
        typer.Option("--on", help="Fly in one process and virtual time, or with real processes over Zenoh."),
    ] = FlightNetwork.IN_PROCESS,
    sample_of: Annotated[
        Path | None,
        typer.Option("--sample-of", metavar="DIR", help="Fly some of that campaign's flights again, and compare."),
    ] = None,
    sample: Annotated[int, typer.Option("--sample", metavar="N", min=1, help="So many of them.")] = 20,
    write: Annotated[
        Path | None, typer.Option("--write", metavar="FILE", help="Write the table into a page, as docs/missions.md.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON at the end, and nothing else.")] = False,
) -> None:
    """Run a mission in many simulated worlds, much faster than real time, and count how the runs end. See
    docs/missions.md.

    Each flight runs the robot's whole process table in one process and virtual time. Its seed decides the faults and
    their times, so a repeated flight is the same bit by bit. `--on zenoh` flies with real processes. Each finished
    flight is a line of `flights.jsonl`, and `--resume` continues an interrupted campaign.

    Exit codes: 0 all promises kept (no collision, inside the fence, landed or handed over); 1 a broken promise, a lost
    process, or a repeated flight with another end; 2 options that cannot be flown; 130 interrupted.
    """
    if sample_of is not None:
        if without_obstacles or any(each is not None for each in (seeds, faults, worlds)):
            text = "Each plan follows from the campaign in --sample-of. Leave out seeds, faults, worlds and the like."
            raise InvalidOptionError("sample_of", text)
        earlier = take_sample(sample_of, mission, sample)
        plans = earlier.plans(on)
    else:
        earlier = None
        chosen = (SEEDS if seeds is None else seeds, Condition.NONE if faults is None else faults, worlds)
        plans = make_plans(mission, *chosen, watched=not without_obstacles, network=on)
    title = page.title_of(plans, repeated=earlier is not None)
    if write is not None:
        _check_page(write, title)
    folder = output or Path("runs") / f"{datetime.now().astimezone():%Y%m%d-%H%M%S}-campaign-{mission}"
    console = make_console()
    shown = Console(quiet=True) if as_json else console
    called_off = False
    flying = FlyingCode()
    with (
        stop_on_signals() as stop,
        _pool(cluster, jobs, on, flying.code, lambda line: shown.print(line, soft_wrap=True)) as pool,
        closing(CampaignLedger(folder, resume=resume)) as ledger,
    ):
        ledger.require(plans)
        claim(folder, flying.code, begun=bool(ledger.results))
        state = CampaignState(ledger.results, earlier)
        try:
            _fly(plans, ledger, flying, state.lost, pool, record=record, console=shown, stop=stop)
            _record_worst(ledger, flying, worst, state, pool, shown, stop)
        except KeyboardInterrupt:
            called_off = True
            shown.print("Called off. Go on with --resume.", style="red")
    if as_json:
        print_summary(str(folder), len(plans), state)
    else:
        show_summary(state, console)
    if write is not None and not called_off and state.results:
        _write_page(write, title, state, flying.code.digest, shown)
    raise typer.Exit(FAILED if not state.as_promised else INTERRUPTED if called_off else OK)


# --- plans -----------------------------------------------------------------------------------------------------------


def make_plans(
    mission: str,
    seeds: str,
    conditions: str,
    worlds: str | None,
    *,
    watched: bool = True,
    network: FlightNetwork = FlightNetwork.IN_PROCESS,
) -> list[FlightPlan]:
    """All flights of a campaign in the order of seeds: an interrupted one has flown all conditions equally often.

    Raises UnknownNameError and InvalidOptionError.
    """
    from importlib.metadata import entry_points  # noqa: PLC0415

    from skillwing.sim_mujoco.world.kinds import KINDS  # noqa: PLC0415 - loads numpy

    missions = entry_points(group=MISSIONS).names
    if mission not in missions:
        raise UnknownNameError("mission", mission, sorted(missions))
    names = conditions_of(mission) if conditions == "all" else _names("condition", conditions, list(Condition))
    worlds = usual_world(mission) if worlds is None else worlds
    kinds = list(KINDS) if worlds == "all" else _names("world", worlds, list(KINDS))
    chosen = parse_seeds(seeds)
    count = len(chosen) * len(kinds) * len(names)
    if count > MOST_FLIGHTS:
        text = f"These are {count:,} flights, and a campaign has {MOST_FLIGHTS:,} at most."
        raise InvalidOptionError("seeds", f"{text} Give fewer seeds, conditions or worlds.")
    plans = [
        FlightPlan(mission=mission, world=kind, seed=seed, condition=Condition(name), watched=watched, network=network)
        for seed in chosen
        for kind in kinds
        for name in names
    ]
    for first in plans[: len(kinds) * len(names)]:
        first.mission_options()  # raises before the first flight if the mission has nothing to do at a site
    return plans


def parse_seeds(text: str) -> range:
    """Seeds from `A:B`, or one. Raises InvalidOptionError."""
    first, colon, end = text.partition(":")
    if not (first.isdecimal() and (end.isdecimal() if colon else not end)):
        raise InvalidOptionError("seeds", f"`{text}` are no seeds. Write `0:100` for 0 to 99, or one number.")
    # By default Python reads numbers of at most 4300 digits.
    readable = max(len(number.lstrip("0")) for number in (first, end)) <= len(str(LARGEST_SEED))
    seeds = range(int(first), int(end) if colon else int(first) + 1) if readable else None
    if seeds is None or (seeds and seeds[-1] > LARGEST_SEED):
        raise InvalidOptionError("seeds", f"A seed is too large in --seeds. The largest is {LARGEST_SEED}.")
    if not seeds:
        raise InvalidOptionError("seeds", f"`{text}` holds no seed. Write `A:B` with A below B.")
    return seeds


def _names(what: str, text: str, known: Sequence[str]) -> list[str]:
    """Names separated by commas, each once. Raises UnknownNameError."""
    names = list(dict.fromkeys(name.strip() for name in text.split(",") if name.strip()))
    for name in names or [text]:
        if name not in known:
            raise UnknownNameError(what, name, known)
    return names


# --- flying ----------------------------------------------------------------------------------------------------------


def _fly(
    plans: Sequence[FlightPlan],
    ledger: CampaignLedger,
    flying: FlyingCode,
    lost: list[LostFlight],
    pool: FlightPool,
    *,
    record: bool,
    console: Console,
    stop: StopSignal,
) -> None:
    """Fly all missing flights. Flights without a result are added to `lost`."""
    flown = {result.plan.name for result in ledger.results}
    missing = [plan for plan in plans if plan.name not in flown]
    at_once = pool.at_once(len(missing))
    console.print(f"{len(missing)} flights, {at_once}; results go to {ledger.folder}.", soft_wrap=True)
    begun = time.monotonic()
    run_dir = partial(begin_recording, ledger.folder) if record else None
    for count, result in enumerate(flying.kept(pool.fly(missing, run_dir, stop.check)), start=1):
        if isinstance(result, LostFlight):
            lost.append(result)
        else:
            keep_recording(ledger.folder, result.plan)
            ledger.add(result)
        left = (time.monotonic() - begun) / count * (len(missing) - count)
        console.print(flight_line(result, f"{count}/{len(missing)}", left), soft_wrap=True)


def _pool(
    cluster: str | None, jobs: int, network: FlightNetwork, code: FlightCode, say: Callable[[str], None]
) -> FlightPool:
    """Pool of this machine, or of a cluster. Raises InvalidOptionError if the cluster cannot be used."""
    if cluster is None:
        return WorkerPool(jobs or (1 if network is FlightNetwork.ZENOH else os.cpu_count() or 1))
    if jobs:
        text = "The number of flights at once follows from the workers of a cluster. Leave out --jobs."
        raise InvalidOptionError("jobs", text)
    try:
        from skillwing.evaluation.campaign.cluster import ClusterPool  # noqa: PLC0415 - the extra need not be there
    except ModuleNotFoundError as error:
        text = f"{error.name} is not installed. To fly on a cluster: pip install 'skillwing[cluster]'."
        raise InvalidOptionError("cluster", text) from error
    return ClusterPool(cluster, code, say)


def _record_worst(
    ledger: CampaignLedger,
    flying: FlyingCode,
    count: int,
    state: CampaignState,
    pool: FlightPool,
    console: Console,
    stop: StopSignal,
) -> None:
    """Fly the worst flights again with the recorder. Flights that differ or are lost are added to `state`."""
    chosen = worst_of(ledger.results, count)
    before = {each.plan.name: each for each in chosen if not is_recorded(ledger.folder, each.plan)}
    if not before:
        return
    console.print(f"Flying the {len(before)} worst flights again, recorded.")
    flights = pool.fly([each.plan for each in before.values()], partial(begin_recording, ledger.folder), stop.check)
    for repeated in flying.kept(flights):
        line = Text(f"  {ledger.folder / repeated.plan.name}")
        if isinstance(repeated, LostFlight):
            line.append(f": not recorded. {repeated.why}", "red")
            state.unrecorded.append(repeated)
        else:
            keep_recording(ledger.folder, repeated.plan)
            if not same_flight(before[repeated.plan.name], repeated):
                line.append(f": not the same flight again; it {repeated.end}", "red")
                state.differing.append(repeated.plan.name)
        console.print(line, soft_wrap=True)


# --- output ----------------------------------------------------------------------------------------------------------


def _check_page(path: Path, title: str) -> None:
    """Raise InvalidOptionError for a page that cannot hold the section, before flights that take hours."""
    try:
        page.check(path, title)
    except PageError as error:
        raise InvalidOptionError("write", str(error)) from error


def _write_page(path: Path, title: str, state: CampaignState, code: str, console: Console) -> None:
    """Write the section, unless flights are missing. code: digest of the code that flew."""
    if state.lost:
        console.print(f"{path} is left as it was: the table would lack these.", style="red", soft_wrap=True)
        return
    more = comparison(state.earlier, state.results) if state.earlier else ()
    section = page.section(title, command_words(), state.results, outcomes(state.results), code, more)
    page.write(path, title, section)
