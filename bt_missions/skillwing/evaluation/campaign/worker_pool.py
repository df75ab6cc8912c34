"""Pool of flights on all cores. Each flight is a process, which bounds memory and the damage of a crash."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import IO, Protocol, Self

import msgspec

from skillwing.evaluation.flights.plan import FlightPlan
from skillwing.evaluation.flights.result import FlightResult
from skillwing.services.processes.child import SINGLE_THREADED

LONGEST = 3600.0
"""Wall seconds after which a flight's process counts as hung, and is killed."""
CHECK_PERIOD = 0.2
"""Wall seconds between two checks for an interruption of the campaign."""
WORKER = (sys.executable, "-m", "skillwing.evaluation.campaign.worker")
"""Command of a flight's process; plan and run directory are appended."""


@dataclass(frozen=True, slots=True)
class LostFlight:
    """A flight whose process ended without a result (killed, out of memory, hung). The cause is the machine, so the
    flight has to be repeated. why: a sentence."""

    plan: FlightPlan
    why: str


class FlightPool(Protocol):
    """Pool that flies plans, here or on other machines. Leaving it ends the flights under way, without results."""

    def __enter__(self) -> Self: ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...

    def at_once(self, count: int) -> str:
        """Words for the number of flights at once, of `count` altogether."""
        ...

    def fly(
        self,
        plans: Iterable[FlightPlan],
        run_dir: Callable[[FlightPlan], Path | None] | None = None,
        check: Callable[[], None] = lambda: None,
    ) -> Iterator[FlightResult | LostFlight]:
        """Fly all plans, and yield each result as soon as it is known.

        run_dir: directory for the recording of a flight; None to record none. check: called several times a second;
        may raise.
        """
        ...


class WorkerPool(FlightPool):
    """Pool of `jobs` flights at once. Leaving it ends the flights under way, without results.

    worker: the command that flies a plan and prints its result.
    """

    def __init__(self, jobs: int, worker: Sequence[str] = WORKER) -> None:
        self._jobs = jobs
        self._worker = worker
        self._pool = ThreadPoolExecutor(jobs)
        self._lock = threading.Lock()
        self._flying: set[subprocess.Popen[bytes]] = set()
        self._dismissed = False

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with self._lock:
            self._dismissed = True
            for process in self._flying:
                process.kill()
        self._pool.shutdown(cancel_futures=True)

    def at_once(self, count: int) -> str:
        return f"{min(self._jobs, count) or 1} at once"

    def fly(
        self,
        plans: Iterable[FlightPlan],
        run_dir: Callable[[FlightPlan], Path | None] | None = None,
        check: Callable[[], None] = lambda: None,
    ) -> Iterator[FlightResult | LostFlight]:
        waiting, flying = iter(plans), set[Future[FlightResult | LostFlight]]()
        while True:
            while len(flying) < self._jobs and (plan := next(waiting, None)) is not None:
                flying.add(self._pool.submit(self._fly, plan, run_dir and run_dir(plan)))
            if not flying:
                return
            check()
            done, flying = wait(flying, CHECK_PERIOD, FIRST_COMPLETED)
            yield from (future.result() for future in done)

    def _fly(self, plan: FlightPlan, run_dir: Path | None) -> FlightResult | LostFlight:
        command = [*self._worker, msgspec.json.encode(plan).decode()]
        if run_dir is not None:
            command.append(str(run_dir))
        with tempfile.TemporaryFile() as complaints:
            process = self._start(command, complaints)
            if process is None:
                return LostFlight(plan, "The campaign was called off.")
            output, code = self._await(process)
            try:
                return msgspec.json.decode(output, type=FlightResult)
            except msgspec.DecodeError:
                complaints.seek(0)
                last = complaints.read().decode(errors="replace").strip().rpartition("\n")[2]
                ended = f"ended with code {code}" if code >= 0 else f"was killed by signal {-code}"
                return LostFlight(plan, f"Its process {ended}. {last}".strip())

    def _start(self, command: list[str], complaints: IO[bytes]) -> subprocess.Popen[bytes] | None:
        """The process of a flight; None once the pool is dismissed."""
        with self._lock:
            if self._dismissed:
                return None
            # In a session of its own: Ctrl-C is for the campaign, which ends its flights itself.
            process = subprocess.Popen(
                command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=complaints,
                env=os.environ | SINGLE_THREADED,
                start_new_session=True,
            )
            self._flying.add(process)
            return process

    def _await(self, process: subprocess.Popen[bytes]) -> tuple[bytes, int]:
        """Output and exit code of a worker. Its standard input stays open, because closing it ends the flight."""
        watchdog = threading.Timer(LONGEST, process.kill)
        watchdog.start()
        try:
            assert process.stdout is not None
            with process:
                output = process.stdout.read()
            return output, process.returncode
        finally:
            watchdog.cancel()
            with self._lock:
                self._flying.discard(process)
