"""Flights with a cut link between robot and station, with a table of the outcomes.

    python tests/links/links_run.py --results runs/links.jsonl --write docs/reliability.md
    python tests/links/links_run.py --only "on board / cruise" --keys

Flights that the same code has flown already, by the file of results, are not flown again. The table has flights of that
code only. Exit code 1 for a broken promise: a collision, or a drone that does not land. An operator who does not know
after 3 s is one as well, and so is a mission that fails although it could go on.
"""

from __future__ import annotations

import argparse
import hashlib
import sys
from collections.abc import Callable
from datetime import datetime
from pathlib import Path

import msgspec
from link_cells import LinkResult, cells, link_table
from link_flight import FlightError, fly
from msgspec.structs import replace
from namespaces import obstacle

from skillwing.evaluation.campaign.flight_code import flight_code
from skillwing.services.terminal.doc_sections import Marks, page_with

PLACE, PLACE_WITH_KEYS = Marks.named("links, cuts"), Marks.named("links, cuts with keys")
TRIES = 2
"""Starts of a flight that did not get to its cut, on a busy machine."""


def main(arguments: list[str] | None = None) -> int:
    """Fly what is asked for and was not flown yet; returns the exit code."""
    parser = argparse.ArgumentParser(description="Flights with a cut link between robot and station.")
    parser.add_argument("--only", default="", metavar="TEXT", help="only cells that have this in their name")
    parser.add_argument("--results", type=Path, metavar="FILE", help="file of results, one a line; it is continued")
    parser.add_argument("--speed", type=float, default=1.0, metavar="FACTOR", help="of the simulated robot")
    parser.add_argument("--keys", action="store_true", help="over TLS, with certificates; a table of its own")
    parser.add_argument("--list", action="store_true", help="print the names of all cells")
    parser.add_argument(
        "--write", type=page_with(PLACE, PLACE_WITH_KEYS), metavar="FILE", help="document for the table"
    )
    wanted = parser.parse_args(arguments)
    if wanted.list:
        _say("\n".join(cell.name for cell in cells()))
        return 0
    if (reason := obstacle()) is not None:
        _say(f"Nothing is flown: {reason}.")
        return 0
    code = code_of_links()
    flown_before = (each for each in _read(wanted.results) if (each.flown_by, each.keys) == (code, wanted.keys))
    results = {result.cell: result for result in flown_before}
    for cell in cells():
        if wanted.only in cell.name and cell not in results:
            flown = _fly_again(lambda cell=cell: fly(cell, wanted.speed, keys=wanted.keys))
            if code_of_links() != code:
                _say("The code has changed meanwhile. This flight is not kept. Start again.")
                return 1
            results[cell] = result = replace(flown, flown_by=code, day=f"{datetime.now().astimezone():%Y-%m-%d}")
            _append(wanted.results, result)
            _say(f"{cell.name}: {'as promised' if result.kept else ', '.join(result.problems)}; {result}")
    chosen = [result for cell, result in results.items() if wanted.only in cell.name]
    if not chosen:
        _say(f"No cell has `{wanted.only}` in its name. --list prints the names.")
        return 2
    _say("\n".join(link_table(chosen)))
    if wanted.write:
        place = PLACE_WITH_KEYS if wanted.keys else PLACE
        place.replace(wanted.write, "\n".join(link_table(list(results.values()))))
    return 0 if all(result.kept for result in chosen) else 1


def code_of_links() -> str:
    """Twelve hexadecimal digits, equal for equal code: of all that flies, and of this trial."""
    own = b"".join(path.read_bytes() for path in sorted(Path(__file__).parent.glob("*.py")))
    return hashlib.sha256(flight_code().digest.encode() + own).hexdigest()[:12]


def _fly_again(flight: Callable[[], LinkResult]) -> LinkResult:
    for attempt in range(1, TRIES + 1):
        try:
            return flight()
        except FlightError as error:
            _say(f"not flown: {error}")
            if attempt == TRIES:
                raise
    raise AssertionError("unreachable")


def _read(file: Path | None) -> list[LinkResult]:
    if file is None or not file.exists():
        return []
    return [msgspec.json.decode(line, type=LinkResult) for line in file.read_text(encoding="utf-8").splitlines()]


def _append(file: Path | None, result: LinkResult) -> None:
    if file is not None:
        file.parent.mkdir(parents=True, exist_ok=True)
        with file.open("a", encoding="utf-8") as lines:
            lines.write(f"{msgspec.json.encode(result).decode()}\n")


def _say(text: str) -> None:
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main())
