"""Pool of flights on the workers of a Dask cluster. A flight is a process there, as it is in the local pool."""

from __future__ import annotations

import asyncio
import logging
import re
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import CancelledError, Future
from pathlib import Path
from queue import Empty, Queue
from time import monotonic
from types import TracebackType
from typing import Self
from uuid import uuid4

import msgspec
from distributed import Client, KilledWorker, Security
from distributed.core import rpc

from skillwing.evaluation.campaign.cluster_worker import FlightReply
from skillwing.evaluation.campaign.flight_code import FlightCode, some_names
from skillwing.evaluation.campaign.recordings import unpack_recording
from skillwing.evaluation.campaign.worker_pool import CHECK_PERIOD, FlightPool, LostFlight
from skillwing.evaluation.flights.plan import FlightPlan
from skillwing.evaluation.flights.result import FlightResult
from skillwing.services.errors import InvalidOptionError, SkillwingError

ADDRESS = re.compile(r"(tcp|tls)://\S+:\d{1,5}")
CONNECT_TIMEOUT = 10.0
"""Wall seconds in which the scheduler has to answer."""
WORKERS_PERIOD = 2.0
"""Wall seconds between two looks at the number of workers."""

FLY_THERE = f"__import__({FlightReply.__module__!r}, fromlist=['*']).fly_here(plan, digest, recorded)"
"""Task of a worker, as text. A worker that cannot import the function of a task would end without an answer."""
REPAIR = "Install the same Skillwing there, with its extras sim, missions and cluster, and go on with --resume."


class ClusterError(SkillwingError):
    """A cluster that cannot fly the rest of a campaign."""


class ClusterPool(FlightPool):
    """Pool of flights on all workers of a cluster. Leaving it cancels the flights that are queued or under way.

    A flight whose worker dies is flown again by another worker. code: the code that has to fly. say: prints a line.
    Raises InvalidOptionError if no scheduler answers at the address.
    """

    def __init__(self, address: str, code: FlightCode, say: Callable[[str], None]) -> None:
        self._address = address
        self._code = code
        self._say = say
        self._client = _connect(address)
        self._waits = False
        self._looked = 0.0

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._client.close()

    def at_once(self, count: int) -> str:
        del count  # the workers decide it, and they come and go
        return f"on the cluster {self._address}"

    def fly(
        self,
        plans: Iterable[FlightPlan],
        run_dir: Callable[[FlightPlan], Path | None] | None = None,
        check: Callable[[], None] = lambda: None,
    ) -> Iterator[FlightResult | LostFlight]:
        """Fly all plans, and yield each result as soon as it is here.

        run_dir: directory for the recording of a flight, asked for when the flight has ended; None to record none.
        check: called several times a second; may raise. Raises InvalidOptionError for a worker with other code, and
        ClusterError if the rest cannot be flown.
        """
        ended: Queue[Future[bytes]] = Queue()
        flying: dict[Future[bytes], FlightPlan] = {}
        executor = self._client.get_executor(pure=False)
        digest, name = self._code.digest, uuid4().hex
        for plan in plans:
            check()
            encoded, recorded = msgspec.json.encode(plan), run_dir is not None
            values = {"plan": encoded, "digest": digest, "recorded": recorded}
            future = executor.submit(eval, FLY_THERE, values, key=f"{plan.name}-{name}")
            flying[future] = plan
            future.add_done_callback(ended.put)
        while flying:
            check()
            self._report_workers()
            try:
                future = ended.get(timeout=CHECK_PERIOD)
            except Empty:
                continue
            yield self._flight(flying.pop(future), future, run_dir)

    def _flight(
        self, plan: FlightPlan, future: Future[bytes], run_dir: Callable[[FlightPlan], Path | None] | None
    ) -> FlightResult | LostFlight:
        reply = self._reply(future)
        if isinstance(reply, str):
            return LostFlight(plan, reply)
        if reply.code is not None:
            raise self._refused(reply.worker, reply.code)
        if reply.error:
            raise ClusterError(f"The worker {reply.worker} cannot fly ({reply.error}). {REPAIR}")
        if reply.result is None:
            return LostFlight(plan, f"{reply.lost} It was on the worker {reply.worker}.")
        if reply.recording and run_dir is not None and (folder := run_dir(plan)) is not None:
            unpack_recording(reply.recording, folder)
        return reply.result

    def _reply(self, future: Future[bytes]) -> FlightReply | str:
        """Reply of a worker, or a sentence on a flight that ended several workers. Raises ClusterError."""
        try:
            return msgspec.msgpack.decode(future.result(), type=FlightReply)
        except KilledWorker as error:
            deaths, last = error.allowed_failures + 1, error.last_worker.address
            return f"{deaths} workers died that had this flight, the last at {last}."
        except CancelledError as error:
            text = f"The connection to the scheduler at {self._address} was lost."
            raise ClusterError(f"{text} Start the scheduler and its workers, and go on with --resume.") from error
        except Exception as error:  # whatever a worker raises whose installation differs
            text = f"A worker of {self._address} cannot fly ({type(error).__name__}: {error})."
            raise ClusterError(f"{text} {REPAIR}") from error

    def _refused(self, worker: str, code: FlightCode) -> InvalidOptionError:
        text = f"The worker {worker} has other code: {some_names(self._code.changes(code))} differ."
        return InvalidOptionError("cluster", f"{text} Install the same version there, and go on with --resume.")

    def _report_workers(self) -> None:
        """Report that all workers are gone, and that there are workers again."""
        if (now := monotonic()) < self._looked + WORKERS_PERIOD:
            return
        self._looked = now
        waits = not self._client.scheduler_info(n_workers=0)["n_workers"]
        if waits and not self._waits:
            advice = f"Start some by `dask worker {self._address}`, or stop with Ctrl-C."
            self._say(f"The cluster has no worker, and the campaign waits for one. {advice}")
        elif self._waits and not waits:
            self._say("The cluster has workers again.")
        self._waits = waits


def _connect(address: str) -> Client:
    if not ADDRESS.fullmatch(address):
        text = f"`{address}` is no address of a Dask scheduler. Write tcp://HOST:PORT, or tls://HOST:PORT."
        raise InvalidOptionError("cluster", text)
    # Sentences of our own say what goes wrong.
    logging.getLogger("distributed.client").setLevel(logging.CRITICAL)
    try:
        asyncio.run(asyncio.wait_for(_ask_scheduler(address), CONNECT_TIMEOUT))
        return Client(address, timeout=CONNECT_TIMEOUT, set_as_default=False)
    except TypeError as error:  # without certificates
        text = f"{address} needs certificates. Name them in Dask's configuration, under distributed.comm.tls."
        raise InvalidOptionError("cluster", text) from error
    except (OSError, ValueError) as error:
        text = f"No Dask scheduler answers at {address}. Start one by `dask scheduler`, and give its address."
        raise InvalidOptionError("cluster", text) from error


async def _ask_scheduler(address: str) -> None:
    """Ask who is there: a client never gives up on a server of another kind."""
    async with rpc(address, connection_args=Security().get_connection_args("client")) as scheduler:
        await scheduler.identity(n_workers=0)
