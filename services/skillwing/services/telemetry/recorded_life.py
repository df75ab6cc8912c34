"""The recorder where no launcher prepares a run for it: in a container.

    python -m skillwing.services.telemetry.recorded_life --process recorder

Each life of the system gets a directory of its own in `runs/`, called after its beginning. A recorder that has died
finds its name in a file and goes on there. One that was told to end takes that file away, since what begins after it is
another flight, at time 0 again.

Everything else, options and exit codes included, is as of node_host.py.
"""

from __future__ import annotations

import os
import sys
from datetime import UTC, datetime
from pathlib import Path

from skillwing.services.errors import SkillwingError
from skillwing.services.processes.hosting import give_up
from skillwing.services.processes.lifetime import EXIT_CONFIGURATION, EXIT_OK
from skillwing.services.processes.node_host import main as host
from skillwing.services.processes.run_options import run_options
from skillwing.services.robot import RECORDER, find_robot
from skillwing.services.telemetry.run_facts import RunFacts, write_facts

RUNS = Path("runs")
MARK = Path(".current-run")
"""Not in `RUNS`, which outlives the container."""


def main(arguments: list[str]) -> int:
    """Record one life of the system; returns the process's exit code."""
    try:
        run_dir = begin_or_go_on(RUNS, MARK, datetime.now(UTC))
        _tell_what_is_run(run_dir)
    except (SkillwingError, OSError) as error:
        return give_up(error, EXIT_CONFIGURATION, RECORDER)
    os.environ["SKILLWING_RUN_DIR"] = str(run_dir)
    code = host(arguments)
    if code == EXIT_OK:
        MARK.unlink(missing_ok=True)
    return code


def begin_or_go_on(folder: Path, mark: Path, now: datetime) -> Path:
    """The directory of the run whose recorder has died, or that of a new one; raises OSError."""
    name = mark.read_text() if mark.exists() else ""
    if not name:
        name = f"{now:%Y%m%d-%H%M%S}-up"
        mark.write_text(name)
    return folder / name


def _tell_what_is_run(run_dir: Path) -> None:
    robot = find_robot(os.environ["SKILLWING_ROBOT"])
    options = run_options(os.environ)
    write_facts(run_dir, RunFacts(robot=robot.name, skillset=str(robot.skillset), judge=robot.judge, options=options))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
