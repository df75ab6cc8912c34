"""The results of the paper, flown again: docs/results.md (`make paper`).

    python benchmarks/paper/run.py [--seeds 0:5] [--jobs 1] [-o runs/paper] [--page docs/results.md]

Flies what is missing and writes the page from all that is there for these seeds; a run that was killed goes on. Each
version of the code that flies has a folder of its own, so that flights of two versions are never compared with each
other. Those flights of the first seed are recorded whose pictures the page shows. A mapping flight takes about a
minute of one core, an inspection two.
"""

from __future__ import annotations

import argparse
import shutil
import sys
from contextlib import closing
from pathlib import Path

from cost_picture import COST_PICTURE, draw_costs
from paper_flights import paper_plans
from paper_page import MARKS, PICTURES, SHOWN, picture_name, write_page
from way_picture import WAYS_PICTURE, draw_ways, flights_drawn

from skillwing.evaluation.campaign.command import parse_seeds
from skillwing.evaluation.campaign.flight_code import FlyingCode
from skillwing.evaluation.campaign.ledger import LEDGER_FILE, CampaignLedger, read_results
from skillwing.evaluation.campaign.output import lost_flights
from skillwing.evaluation.campaign.recordings import begin_recording, is_recorded, keep_recording
from skillwing.evaluation.campaign.worker_pool import LostFlight, WorkerPool
from skillwing.evaluation.flights.plan import FlightPlan
from skillwing.evaluation.flights.result import End, FlightResult
from skillwing.services.errors import SkillwingError
from skillwing.services.terminal.doc_sections import page_with

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "results.md"
PICTURED = SHOWN | flights_drawn()


def main() -> None:
    options = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    options.add_argument("--seeds", default="0:5", metavar="A:B")
    options.add_argument("--jobs", type=int, default=1, metavar="N", help="flights at once")
    options.add_argument("-o", "--output", type=Path, default=ROOT / "runs" / "paper", metavar="DIR")
    options.add_argument("--page", type=page_with(MARKS), default=str(PAGE), metavar="FILE")
    options.add_argument("--only-write", action="store_true", help="fly nothing: the page from what is there")
    chosen = options.parse_args()
    if chosen.jobs < 1:
        sys.exit("No flight can be flown by so few. Give `--jobs 1` or more.")
    flying = FlyingCode()
    digest = flying.code.digest
    folder = chosen.output / digest
    try:
        plans = paper_plans(parse_seeds(chosen.seeds))
        flown = known(folder) if chosen.only_write else fly(plans, folder, chosen.jobs, flying)
        results = list({result.plan.name: result for result in flown if result.plan in plans}.values())
        if not results:
            sys.exit(f"Nothing has been flown by this code ({digest}) yet. Leave out `--only-write`.")
        first = [result.plan for result in results if result.plan.seed == plans[0].seed]
        images = chosen.page.parent / "images" / "results"
        drawn = draw_pictures(first, folder, images)
        draw_costs(images / COST_PICTURE, results)
        write_page(chosen.page, results, plans, digest, {*drawn, COST_PICTURE})
    except SkillwingError as error:
        sys.exit(str(error))
    except KeyboardInterrupt:
        sys.exit("Called off. The same command goes on with it.")


def known(folder: Path) -> list[FlightResult]:
    """Results so far, also of a run in progress."""
    ledger = folder / LEDGER_FILE
    return read_results(ledger) if ledger.exists() else []


def fly(plans: list[FlightPlan], folder: Path, jobs: int, flying: FlyingCode) -> list[FlightResult]:
    """Fly what the ledger has not. Those that the page shows are recorded, each in a folder of its own.

    flying: what the folder's flights are flown by. Raises CodeChangedError when that is not the same any more, and
    SkillwingError at the end where a flight's process did not end well.
    """
    ledger = CampaignLedger(folder, resume=True)
    flown = [result.plan for result in ledger.results]
    shown = [plan for plan in plans if plan.seed == plans[0].seed and (plan.mission, plan.label) in PICTURED]
    missing = [plan for plan in plans if plan not in flown or (plan in shown and not is_recorded(folder, plan))]

    def run_dir(plan: FlightPlan) -> Path | None:
        return begin_recording(folder, plan) if plan in shown else None

    lost: list[LostFlight] = []
    with closing(ledger), WorkerPool(jobs) as pool:
        for count, result in enumerate(flying.kept(pool.fly(missing, run_dir)), start=1):
            if isinstance(result, LostFlight):
                lost.append(result)
                continue
            if result.end is not End.BROKE_OFF:
                keep_recording(folder, result.plan)
            ledger.add(result)
            end = f"{result.end}, {result.end_time:.0f} s, {', '.join(result.broken) or 'promises kept'}"
            sys.stdout.write(f"{count}/{len(missing)} {result.plan.name}: {end}\n")
            sys.stdout.flush()
    if lost:
        raise SkillwingError(f"{lost_flights(lost)} The same command flies what is missing.")
    return ledger.results


def draw_pictures(flown: list[FlightPlan], folder: Path, images: Path) -> set[str]:
    """Put what the recorded ones of these flights look like beside the page, and tell the names of these pictures."""
    images.mkdir(parents=True, exist_ok=True)
    recorded = {(plan.mission, plan.label): plan for plan in flown if is_recorded(folder, plan)}
    drawn: set[str] = set()
    for picture in PICTURES:
        plan = recorded.get((picture.mission, picture.label))
        if plan is not None:
            shutil.copyfile(folder / plan.name / picture.file, images / picture_name(picture))
            drawn.add(picture_name(picture))
    ways = {label: plan for (mission, label), plan in recorded.items() if (mission, label) in flights_drawn()}
    if len(ways) == len(flights_drawn()):
        runs = {label: folder / plan.name for label, plan in ways.items()}
        draw_ways(images / WAYS_PICTURE, next(iter(ways.values())), runs)
        drawn.add(WAYS_PICTURE)
    return drawn


if __name__ == "__main__":
    main()
