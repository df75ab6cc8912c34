"""Fill the disk of a running system for a minute, again and again, and look at what it does and says.

    python tests/soak/full_disk_run.py --outages 6 --seed 1 --write docs/reliability.md

The disk is a small one in memory, so this needs root. On mocks, goals are started all the time, and a process is killed
in most of the outages. Then a mission flies in the simulator, with an outage in it. Ends with 1 for a broken promise.
"""

from __future__ import annotations

import argparse
import os
import platform
import random
import sys
import tempfile
from contextlib import ExitStack
from datetime import UTC, datetime
from pathlib import Path

from full_disk_figures import MissionOutage, Outage, table
from full_disk_mission import fly
from full_disk_mocks import KILLED, MockedSystem

from skillwing.services.terminal.doc_sections import Marks, page_with
from small_disk import mounted, obstacle

MARKS = Marks.named("full disk")
MOCKS_DISK, MISSION_DISK = 96 << 20, 160 << 20


def _say(text: str) -> None:
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()


def _on_mocks(number: int, seconds: float, chance: random.Random, folder: Path) -> list[Outage]:
    found: list[Outage] = []
    with mounted(folder / "mocks", MOCKS_DISK) as disk, MockedSystem(disk, folder) as system:
        for turn in range(number):
            system.work(chance.uniform(2.0, 10.0))
            found.append(system.suffer(seconds, KILLED[turn % len(KILLED)], chance.uniform(0.0, seconds / 2)))
            _say(f"{found[-1]}")
        if found:
            found[-1].problems.extend(system.end())
    return found


def main(arguments: list[str] | None = None) -> int:
    """Run the outages; returns the exit code."""
    parser = argparse.ArgumentParser(description="Fill the disk of a running system for a minute, again and again.")
    add = parser.add_argument
    add("--outages", type=int, default=6, metavar="N", help="on mocks (default: %(default)s)")
    add("--seconds", type=float, default=60.0, help="length of each (default: %(default)s)")
    add("--seed", type=int, default=1, help="of the moments (default: %(default)s)")
    add("--no-mission", action="store_true", help="leave the flight out")
    add("--write", type=page_with(MARKS), metavar="FILE", help="document that gets the table")
    asked = parser.parse_args(arguments)
    if (reason := obstacle()) is not None:
        _say(f"Nothing is filled: {reason}.")
        return 0
    chance = random.Random(asked.seed)
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="full-disk-")))
        os.environ["XDG_RUNTIME_DIR"] = str(folder)
        outages = _on_mocks(asked.outages, asked.seconds, chance, folder)
        flight: MissionOutage | None = None
        if not asked.no_mission:
            with mounted(folder / "mission", MISSION_DISK) as disk:
                flight = fly(disk, asked.seconds, chance.uniform(15.0, 45.0))
            _say(f"{flight}")
    where = f"{os.cpu_count()} processors, {platform.machine()}, Python {platform.python_version()}"
    figures = f"{table(outages, flight)}\n\nSeed {asked.seed}, {where}, {datetime.now(UTC):%Y-%m-%d}."
    _say(figures)
    if asked.write is not None:
        MARKS.replace(asked.write, figures)
    return 1 if any(each.problems for each in outages) or (flight is not None and flight.problems) else 0


if __name__ == "__main__":
    sys.exit(main())
