"""The recorder in a container, without a launcher that prepares its run.

    python -m skillwing.services.recording.container_recorder --process recorder

Each life of the system gets a directory in `runs/`, named after its start time. A recorder that restarts after a crash
finds the name in a file, and continues there. A recorder that is told to end removes that file: the next life is
another run, from time 0.

All else, options and exit codes included, is as in node_host.py.
"""

from __future__ import annotations

import argparse
import os
import signal
import sys
from datetime import UTC, datetime
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING

from skillwing.services.processes.lifetime import EXIT_CONFIGURATION, EXIT_OK

if TYPE_CHECKING:
    from skillwing.services.recording.run_facts import RunFacts

RUNS = Path("runs")
MARK = Path(".current-run")
"""File with the name of the current run. It is not in `RUNS`, which outlives the container."""


class _ToldToEndError(BaseException):
    """Request to end. A KeyboardInterrupt would not do: after it passes through `exec`, as in the making of a
    dataclass, Python exits with 130 even if it is caught."""


def _end(number: int, frame: FrameType | None) -> None:
    raise _ToldToEndError


def main(arguments: list[str]) -> int:
    """Record one life of the system; returns the exit code."""
    # A request to end before the host has its own handlers is a good end, too.
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, _end)
    try:
        code = _record(arguments)
    except _ToldToEndError:
        code = EXIT_OK
    if code == EXIT_OK:
        MARK.unlink(missing_ok=True)
    return code


def _record(arguments: list[str]) -> int:
    # These imports take a while, in which a request to end may come.
    from skillwing.services.errors import SkillwingError  # noqa: PLC0415
    from skillwing.services.processes import node_host  # noqa: PLC0415
    from skillwing.services.processes.hosting import give_up  # noqa: PLC0415
    from skillwing.services.recording.run_facts import write_facts  # noqa: PLC0415
    from skillwing.services.robot import RECORDER  # noqa: PLC0415

    try:
        facts = _what_is_run(arguments)
        run_dir = begin_or_go_on(RUNS, MARK, datetime.now(UTC))
        write_facts(run_dir, facts, goes_on=True)
    except (SkillwingError, OSError) as error:
        return give_up(error, EXIT_CONFIGURATION, RECORDER)
    os.environ["SKILLWING_RUN_DIR"] = str(run_dir)
    return node_host.main(arguments)


def begin_or_go_on(folder: Path, mark: Path, now: datetime) -> Path:
    """The directory of the run whose recorder has crashed, or else a new one; raises OSError."""
    name = mark.read_text() if mark.exists() else ""
    if not name:
        name = f"{now:%Y%m%d-%H%M%S}-up"
        mark.write_text(name)
    return folder / name


def _what_is_run(arguments: list[str]) -> RunFacts:
    """Facts of the run from command line and environment, as the host reads them; raises SkillwingError without
    them."""
    from skillwing.services.errors import InvalidOptionError  # noqa: PLC0415
    from skillwing.services.processes.run_options import run_options  # noqa: PLC0415
    from skillwing.services.recording.run_facts import RunFacts  # noqa: PLC0415
    from skillwing.services.robot import find_robot  # noqa: PLC0415

    words = argparse.ArgumentParser(add_help=False)
    words.add_argument("--robot", default=os.environ.get("SKILLWING_ROBOT"))
    name = words.parse_known_args(arguments)[0].robot
    if not name:
        raise InvalidOptionError("robot", "No robot is named. Give it with --robot, or as SKILLWING_ROBOT.")
    robot, options = find_robot(name), run_options(os.environ)
    return RunFacts(robot=robot.name, skillset=str(robot.skillset), judge=robot.judge, options=options)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
