"""The process of one flight: a plan comes in as JSON, its result goes out.

    python -m skillwing.evaluation.campaign.worker '{"mission": "mapping", ...}' [RUN_DIR]

It ends when its standard input does, so that no flight outlives the campaign that it belongs to.
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
    # What nodes say of a fault that they were meant to meet is in the recording; here it would drown what is not.
    logging.basicConfig(stream=sys.stderr, level=logging.ERROR)
    plan = msgspec.json.decode(arguments[0], type=FlightPlan)
    run_dir = Path(arguments[1]) if len(arguments) > 1 else None

    from skillwing.evaluation.judged_flight import fly  # noqa: PLC0415 - loads physics; a plan that is wrong needs none

    sys.stdout.buffer.write(msgspec.json.encode(fly(plan, run_dir)) + b"\n")


def _follow_parent() -> None:
    while os.read(sys.stdin.fileno(), 4096):
        pass
    os._exit(1)


if __name__ == "__main__":
    main(sys.argv[1:])
