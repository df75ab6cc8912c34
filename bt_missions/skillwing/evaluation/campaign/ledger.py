"""Folder of one campaign. `flights.jsonl` gets a line when a flight ends.

A resumed campaign continues after the last complete line.
"""

from __future__ import annotations

import fcntl
import logging
import os
from collections.abc import Iterable
from contextlib import ExitStack
from pathlib import Path
from typing import BinaryIO

import msgspec

from skillwing.evaluation.flights.plan import FlightPlan
from skillwing.evaluation.flights.result import FlightResult
from skillwing.services.errors import InvalidOptionError

LEDGER_FILE = "flights.jsonl"

log = logging.getLogger(__name__)


class CampaignLedger:
    """Results of a campaign, written to disk at once. The file is locked until it is closed.

    Raises InvalidOptionError for a folder that holds a campaign and is not to be resumed, and for one that another
    campaign writes to; OSError if the folder is not writable.
    """

    def __init__(self, folder: Path, *, resume: bool) -> None:
        self.folder = folder
        path = folder / LEDGER_FILE
        folder.mkdir(parents=True, exist_ok=True)
        try:
            path.touch(exist_ok=resume)
        except FileExistsError:
            text = f"{folder} holds a campaign already. Go on with it by --resume, or choose another folder."
            raise InvalidOptionError("output", text) from None
        with ExitStack() as opened:
            self._file = opened.enter_context(path.open("ab"))
            _reserve(self._file, folder)
            self.results = read_results(path)
            # Without the line at which the campaign was killed.
            self._file.truncate(path.read_bytes().rfind(b"\n") + 1)
            opened.pop_all()

    def require(self, plans: Iterable[FlightPlan]) -> None:
        """Raise InvalidOptionError if the ledger has a flight without a plan: a folder holds one campaign."""
        planned = {plan.name: plan for plan in plans}
        others = [each.plan.name for each in self.results if planned.get(each.plan.name) != each.plan]
        if others:
            more = f" and {len(others) - 1} more" if len(others) > 1 else ""
            text = f"{self.folder} holds flights that this campaign would not fly: {others[0]}{more}."
            advice = "Give the options of the campaign in there, for more seeds if you like, or choose another folder."
            raise InvalidOptionError("resume", f"{text} {advice}")

    def add(self, result: FlightResult) -> None:
        """Store a result."""
        self.results.append(result)
        self._file.write(_line(result))
        self._file.flush()
        os.fsync(self._file.fileno())

    def close(self) -> None:
        self._file.close()


def read_results(path: Path) -> list[FlightResult]:
    """All results in a ledger's file, without an incomplete last line.

    Raises InvalidOptionError for a line that is no flight, and for a repeated flight.
    """
    *lines, _ = path.read_bytes().split(b"\n")
    results: dict[bytes, FlightResult] = {}
    for number, line in enumerate(lines, start=1):
        try:
            result = msgspec.json.decode(line, type=FlightResult)
        except msgspec.DecodeError as error:
            raise _unreadable(path, number, f"is no flight: {error}.") from error
        plan = msgspec.json.encode(result.plan)  # by whatever it was flown: a tree of that name may have changed
        if plan in results:
            raise _unreadable(path, number, f"is {result.plan.name}, which an earlier line is, too.")
        results[plan] = result
    return list(results.values())


def _unreadable(path: Path, number: int, why: str) -> InvalidOptionError:
    advice = "Take this line out, and by --resume what is missing is flown; or choose another folder."
    return InvalidOptionError("output", f"Line {number} of {path} {why} {advice}")


def _reserve(file: BinaryIO, folder: Path) -> None:
    """Lock the file until it is closed. The kernel closes the file of a killed process.

    Raises InvalidOptionError if another campaign has locked it. Without file locks, a warning is logged.
    """
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        text = f"Another campaign is flying into {folder}. Wait for its end, or choose another folder."
        raise InvalidOptionError("output", text) from None
    except OSError as error:
        log.warning("%s cannot be locked (%s). Let no other campaign fly into it meanwhile.", folder, error.strerror)


def _line(result: FlightResult) -> bytes:
    return msgspec.json.encode(result) + b"\n"
