"""Kills and stops of every kind of process, in every state of a goal and in flight, with a table of the outcomes.

    python tests/chaos/chaos_run.py --managers --write docs/reliability.md

Exit code 1 for a broken promise: a goal without an answer, a resource that stays taken, a system that does not
recover, or a drone that collides or does not land. A cause chain that does not hold is one as well.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path

from flights_with_faults import FlightResult, flight_cells, fly
from stand import Cell, Result, Stand, cells
from tables import PLACES, flight_table, manager_table, told

from skillwing.services.terminal.doc_sections import page_with


def run_managers(repeats: int, wanted: Callable[[str], bool]) -> Iterator[Result]:
    """Every cell of the stand, as often as told. A system that is not sound afterwards is replaced."""
    with ExitStack() as systems:
        stand: Stand | None = None
        for cell in (cell for _ in range(repeats) for cell in cells() if wanted(_name(cell))):
            if stand is None or not stand.make_sound():
                systems.close()
                stand = systems.enter_context(_new_stand(systems))
            yield stand.suffer(cell)


def _new_stand(systems: ExitStack) -> Stand:
    return Stand(Path(systems.enter_context(tempfile.TemporaryDirectory(prefix="chaos-"))))


def _name(cell: Cell) -> str:
    return f"{cell.process} {cell.fault} {cell.state}"


def main(arguments: list[str] | None = None) -> int:
    """Run what is asked for, print it and write it down; returns the exit code."""
    parser = argparse.ArgumentParser(description="The chaos matrix: each process, each state, killed and stopped.")
    parser.add_argument("--managers", action="store_true", help="only the managers, some minutes")
    parser.add_argument("--flights", action="store_true", help="only the flights of the m600, more than half an hour")
    parser.add_argument("--repeats", type=int, default=1, metavar="N", help="of each of the managers' cells")
    parser.add_argument("--only", default="", metavar="TEXT", help="only what has this in `PROCESS FAULT STATE`")
    parser.add_argument(
        "--write", type=page_with(*PLACES.values()), metavar="FILE", help="document that gets the tables"
    )
    wanted = parser.parse_args(arguments)
    if wanted.write and wanted.only:
        parser.error("--write needs all of it: leave --only out")
    # The stand's processes import what they are made of from here.
    os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, [str(Path(__file__).parent), os.environ.get("PYTHONPATH")]))
    both = wanted.managers == wanted.flights
    broken = 0
    if wanted.managers or both:
        started = time.monotonic()
        results: list[Result] = []
        for result in run_managers(wanted.repeats, lambda name: wanted.only in name):
            results.append(result)
            _say(f"{_name(result.cell)}: noticed {result.noticed}; {told(result)}")
        broken += _finish("managers", manager_table(results, time.monotonic() - started), results, wanted.write)
    if wanted.flights or both:
        started = time.monotonic()
        flights: list[FlightResult] = []
        for cell in flight_cells():
            if wanted.only in f"{cell.process} {cell.fault} {cell.moment}":
                flights.append(fly(cell))
                _say(f"{cell.process} {cell.fault} {cell.moment}: {flights[-1].outcome}; {flights[-1].mission}")
        broken += _finish("flights", flight_table(flights, time.monotonic() - started), flights, wanted.write)
    return 1 if broken else 0


def _finish(part: str, table: list[str], results: Sequence[Result | FlightResult], document: Path | None) -> int:
    """Print a table, write it down if there is a document; returns how many promises were broken."""
    _say("\n".join(table))
    if document is not None:
        PLACES[part].replace(document, "\n".join(table))
    return sum(not each.kept for each in results)


def _say(text: str) -> None:
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main())
