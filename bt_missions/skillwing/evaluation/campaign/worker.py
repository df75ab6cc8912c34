"""Process of one flight: it takes a plan and prints the result, both as JSON.

    python -m skillwing.evaluation.campaign.worker '{"mission": "mapping", ...}' [RUN_DIR]

It ends when its standard input closes, so that no flight outlives its campaign.
"""

from __future__ import annotations

import logging
import os
import sys
import threading
from pathlib import Path

import msgspec

from skillwing.evaluation.flights.plan import FlightPlan


def main(arguments: list[str]) -> None:
    threading.Thread(target=_follow_parent, name="parent", daemon=True).start()
    # Warnings about planned faults are in the recording; here they would hide errors.
    logging.basicConfig(stream=sys.stderr, level=logging.ERROR)
    plan = msgspec.json.decode(arguments[0], type=FlightPlan)
    run_dir = Path(arguments[1]) if len(arguments) > 1 else None

    from skillwing.evaluation.judged_flight import fly  # noqa: PLC0415 - loads physics; a wrong plan needs none

    sys.stdout.buffer.write(msgspec.json.encode(fly(plan, run_dir)) + b"\n")


def _follow_parent() -> None:
    while os.read(sys.stdin.fileno(), 4096):
        pass
    os._exit(1)


if __name__ == "__main__":
    main(sys.argv[1:])
