"""Flight of a campaign on a worker of a Dask cluster.

Only bytes travel between the client and a worker: they may have different versions of this package.
"""

from __future__ import annotations

import tempfile
import threading
from functools import cache
from pathlib import Path

import msgspec
from dask.typing import Key
from distributed import Reschedule, Status, Worker, get_worker

from skillwing.evaluation.campaign.flight_code import FlightCode, FlyingCode
from skillwing.evaluation.campaign.recordings import pack_recording
from skillwing.evaluation.campaign.worker_pool import LostFlight, WorkerPool
from skillwing.evaluation.flights.plan import FlightPlan
from skillwing.evaluation.flights.result import FlightResult

_hashing = threading.Lock()


class FlightReply(msgspec.Struct, frozen=True, kw_only=True):
    """Reply of a worker to one flight.

    worker: its address. One of these is set: result; lost, why this flight has none; error, why the worker cannot fly;
    code, the worker's if it differs. recording: the files of a recorded flight, packed.
    """

    worker: str
    result: FlightResult | None = None
    lost: str = ""
    error: str = ""
    code: FlightCode | None = None
    recording: bytes = b""


def fly_here(plan: bytes, digest: str, recorded: bool) -> bytes:
    """Fly a plan in a process of its own, and return an encoded FlightReply.

    plan: as JSON. digest: of the code that has to fly. It is compared before and after the flight, because the flight's
    process reads the code from the disk.
    """
    worker = get_worker()
    try:
        reply = _refusal(worker.address, digest)
        if reply is None:
            with tempfile.TemporaryDirectory(dir=worker.local_directory) as folder:
                run_dir = Path(folder) if recorded else None
                reply = _fly(worker, msgspec.json.decode(plan, type=FlightPlan), run_dir)
            reply = _refusal(worker.address, digest) or reply
    except (OSError, ImportError) as error:  # a full disk, or a missing library
        reply = FlightReply(worker=worker.address, error=f"{type(error).__name__}: {error}")
    return msgspec.msgpack.encode(reply)


def _fly(worker: Worker, plan: FlightPlan, run_dir: Path | None) -> FlightReply:
    key = worker.get_current_task()

    def check() -> None:
        if not _is_awaited(worker, key):
            raise Reschedule  # to another worker, if the client still awaits the flight

    with WorkerPool(1) as pool:
        (flight,) = pool.fly([plan], lambda _plan: run_dir, check)
    if isinstance(flight, LostFlight):
        return FlightReply(worker=worker.address, lost=flight.why)
    recording = pack_recording(run_dir) if run_dir is not None else b""
    return FlightReply(worker=worker.address, result=flight, recording=recording)


def _is_awaited(worker: Worker, key: Key) -> bool:
    """False once the client has cancelled the flight or is gone, and while the worker closes."""
    task = worker.state.tasks.get(key)
    return task is not None and task.state != "cancelled" and worker.status not in (Status.closing, Status.closed)


def _refusal(worker: str, digest: str) -> FlightReply | None:
    """Reply of a worker with other code; None if the code is the same."""
    with _hashing:
        code = _flying().now()
    return None if code.digest == digest else FlightReply(worker=worker, code=code)


@cache
def _flying() -> FlyingCode:
    return FlyingCode()
