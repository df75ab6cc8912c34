"""`python -m simulation`: many seeds, or the story of one."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from simulation.campaign import run_campaign, shrink
from simulation.ledger import Ledger, code_version, part_of
from simulation.plan import draw_plan
from simulation.report import MARKS, write_section
from simulation.story import tell
from skillwing.services.terminal.doc_sections import page_with


def main() -> int:
    parser = argparse.ArgumentParser(prog="simulation", description=__doc__)
    parser.add_argument("--seed", type=int, help="carry out this seed, and tell its story")
    parser.add_argument("-v", "--verbose", action="store_true", help="tell of every message, too")
    parser.add_argument("--shrink", action="store_true", help="leave out of a failing seed what it does not need")
    parser.add_argument("--runs", type=int, default=2000, help="how many seeds (default: 2000)")
    parser.add_argument("--first", type=int, default=0, help="the first seed (default: 0)")
    parser.add_argument("--jobs", type=int, default=2, help="how many processes (default: 2)")
    parser.add_argument("--seconds", type=float, help="stop after so much wall time")
    parser.add_argument("--record", type=Path, help="go on with the campaign in this file until it has so many seeds")
    parser.add_argument(
        "--write", type=page_with(MARKS), help="write what came out, or stands in --record, into this page"
    )
    arguments = parser.parse_args()
    say = sys.stdout.write
    if arguments.seed is not None:
        plan = draw_plan(arguments.seed)
        if arguments.shrink:
            plan = shrink(plan)
        outcome = tell(plan, _print, messages=arguments.verbose)
        return 1 if outcome.problems else 0
    ledger = Ledger(arguments.record)
    version = code_version()
    first = max(arguments.first, ledger.next_seed)
    result = run_campaign(
        first,
        arguments.first + arguments.runs - first,
        jobs=arguments.jobs,
        seconds=arguments.seconds,
        on_part=lambda start, part: ledger.add(part_of(start, part, version)),
    )
    say(result.text() + "\n")
    if arguments.write is not None:
        write_section(arguments.write, ledger.parts)
    return 1 if any(part.failures for part in ledger.parts) else 0


def _print(line: str) -> None:
    sys.stdout.write(line + "\n")


if __name__ == "__main__":
    sys.exit(main())
