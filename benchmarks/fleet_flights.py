"""Flights of two drones in one world, over seeds and conditions, in one process each.

    python benchmarks/fleet_flights.py --seeds 20 --jobs 2 --write

Each flight is a pure function of its plan and of the code. Results are kept in runs/fleet-flights.jsonl: an interrupted
run goes on there, as long as the code is the same.
"""

from __future__ import annotations

import argparse
import hashlib
import multiprocessing
import sys
from collections.abc import Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from importlib import import_module
from pathlib import Path
from typing import Any

import msgspec
from performance_page import again_by, machine, table

from skillwing.evaluation import fleet
from skillwing.evaluation.campaign.flight_code import flight_code
from skillwing.evaluation.fleet.plan import FleetCondition, FleetPlan
from skillwing.evaluation.fleet.result import FleetResult
from skillwing.evaluation.fleet.yard import PLACES
from skillwing.evaluation.flights.result import End
from skillwing.services.bus.inprocess import SentMessage
from skillwing.services.terminal.doc_sections import Marks, PageError

PAGE = Path(__file__).parents[1] / "docs" / "reliability.md"
MARKS = Marks.named("flights of two drones")
HISTORY = Path(__file__).parents[1] / "tests" / "history"


class StoredFlight(msgspec.Struct, frozen=True):
    """A result, and the digest of the code that flew."""

    code: str
    result: FleetResult


def fly(plan: FleetPlan) -> FleetResult:
    """Fly one plan in a process of its own, and judge the histories of the places."""
    sys.path.insert(0, str(HISTORY))
    place_history: Any = import_module("place_history")
    from skillwing.evaluation.fleet.flight import fly_fleet  # noqa: PLC0415 - loads physics

    histories = {place: place_history.PlaceHistory(place) for place in PLACES}

    def tap(message: SentMessage) -> None:
        for history in histories.values():
            history.take(message)

    result = fly_fleet(plan, tap=tap)
    verdicts = {place: history.judge() for place, history in histories.items()}
    wrong = [f"{place}: {verdict}" for place, verdict in verdicts.items() if not verdict.linearizable]
    return msgspec.structs.replace(result, history=" ".join(wrong))


def fly_all(plans: Sequence[FleetPlan], store: Path, code: str, jobs: int) -> list[FleetResult]:
    """Results of all plans, in their order; those that the same code has flown already are taken from the store."""
    known = {each.result.plan: each.result for each in _stored(store) if each.code == code}
    missing = [plan for plan in plans if plan not in known]
    store.parent.mkdir(parents=True, exist_ok=True)
    with ProcessPoolExecutor(jobs, multiprocessing.get_context("spawn"), max_tasks_per_child=1) as pool:
        flights = [pool.submit(fly, plan) for plan in missing]
        for number, flight in enumerate(as_completed(flights), 1):
            result = flight.result()
            known[result.plan] = result
            with store.open("ab") as file:
                file.write(msgspec.json.encode(StoredFlight(code, result)) + b"\n")
            sys.stdout.write(f"{number}/{len(missing)} {line(result)}\n")
            sys.stdout.flush()
    return [known[plan] for plan in plans]


def line(result: FleetResult) -> str:
    """A flight in a line."""
    parts = [f"{robot} {each.phase or 'cut off'}, {each.end}" for robot, each in result.robots.items()]
    broken = [f"BROKEN: {robot} {', '.join(each.broken)}" for robot, each in result.robots.items() if each.broken]
    met = ["BROKEN: both in one place"] if result.met else []
    waits = [f"BROKEN: the mission of {robot} has no end" for robot in result.unfinished]
    visits = [] if result.kept or broken or met or waits else [f"BROKEN: landings on the pad: {result.visits}"]
    rest = [*met, *waits, *visits, *filter(None, [result.history, result.error])]
    return "; ".join([f"{result.plan.name}: {result.end_time:.0f} s", *parts, *broken, *rest])


def rows(results: Iterable[FleetResult]) -> list[list[str]]:
    """A row for each condition."""
    by_condition: dict[FleetCondition, list[FleetResult]] = {}
    for result in results:
        by_condition.setdefault(result.plan.condition, []).append(result)
    return [_row(condition, flown) for condition, flown in by_condition.items()]


def _row(condition: FleetCondition, flown: Sequence[FleetResult]) -> list[str]:
    drones = [each for result in flown for each in result.robots.values()]
    distances = [result.separation for result in flown if result.separation is not None]
    shares = sorted(result.coverage for result in flown if result.coverage is not None)
    middle = f"{100 * shares[len(shares) // 2]:.0f} %" if shares else "-"
    return [
        str(condition),
        str(len(flown)),
        str(sum(each.collisions for each in drones)),
        str(sum(each.breaches for each in drones)),
        str(sum(each.end in (End.FLYING, End.NOT_LANDED, End.BROKE_OFF) for each in drones)),
        f"{sum(result.succeeded for result in flown)} of {len(drones)}",
        f"{sum(each.end is End.HOME for each in drones)} of {len(drones)}",
        str(sum(result.met > 0 for result in flown)),
        str(sum(len(result.unfinished) for result in flown)),
        f"{sum(not result.history for result in flown)} of {len(flown)}",
        str(sum(result.held_at_kill is True for result in flown)),
        f"{sum(sum(result.visits.values()) for result in flown)}",
        f"{sum(result.kept for result in flown)} of {len(flown)}",
        f"{min(distances):.1f} m" if distances else "-",
        middle,
        f"{max(result.end_time for result in flown):.0f} s",
    ]


def section(results: Sequence[FleetResult], code: str, command: str) -> str:
    """The lines between the marks of the page."""
    heads = (
        *("condition", "flights", "collisions", "left the fence", "drones not on the ground at the end"),
        *("missions that succeeded", "drones at home", "both in one place", "missions without an end", "linearizable"),
        *("killed while the pad was held", "landings on the pad", "as promised"),
        *("least distance", "mapped by both, median", "longest flight"),
    )
    seconds = sum(result.processor_time for result in results)
    return "\n".join(
        [
            table(heads, rows(results)),
            "",
            f"{len(results)} flights, {seconds / 60.0:.0f} minutes of processor time, by code {code}. {machine()}.",
            f"`python benchmarks/{command}` flies them again.",
        ]
    )


def code_of_fleets() -> str:
    """Twelve hexadecimal digits, equal for equal code: of all that flies one drone, of the yard, of two drones, and of
    what judges the histories."""
    yard = Path(__file__).parents[1] / "examples" / "yard"
    files = sorted(file for folder in (Path(fleet.__path__[0]), yard) for file in folder.iterdir() if file.is_file())
    files += [HISTORY / name for name in ("linearizability.py", "place_history.py")]
    own = b"".join(file.read_bytes() for file in files)
    return hashlib.sha256(flight_code().digest.encode() + own).hexdigest()[:12]


def _stored(store: Path) -> list[StoredFlight]:
    if not store.exists():
        return []
    return [msgspec.json.decode(each, type=StoredFlight) for each in store.read_bytes().splitlines() if each]


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seeds", type=int, default=20, help="number of seeds, from 0 on")
    parser.add_argument("--conditions", nargs="+", type=FleetCondition, default=list(FleetCondition))
    parser.add_argument("--jobs", type=int, default=2, help="flights at once")
    parser.add_argument("--store", type=Path, default=Path("runs/fleet-flights.jsonl"))
    parser.add_argument("--write", action="store_true", help="put the table into docs/reliability.md")
    given = parser.parse_args()
    code = code_of_fleets()
    plans = [FleetPlan(seed=seed, condition=each) for seed in range(given.seeds) for each in given.conditions]
    results = fly_all(plans, given.store, code, given.jobs)
    results.sort(key=lambda result: list(FleetCondition).index(result.plan.condition))
    text = section(results, code, again_by(["fleet_flights.py"], sys.argv[1:]))
    sys.stdout.write(f"{text}\n")
    if given.write:
        try:
            MARKS.replace(PAGE, text)
        except PageError as error:
            sys.exit(str(error))
    if not all(result.kept for result in results):
        sys.exit(1)


if __name__ == "__main__":
    main()
