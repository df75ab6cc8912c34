"""Own pool of flights on this machine, compared with a local Dask cluster that does the same.

    python benchmarks/flight_pools.py [--flights N] [--write]

Each flight names a mission that does not exist. It loads everything that flies and breaks off at its start, so the
figures are those of the pools.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from functools import cache, partial
from pathlib import Path
from time import monotonic

import msgspec
import psutil
from distributed import LocalCluster
from performance_page import machine, make_parser, table, write_section

from skillwing.evaluation.campaign.cluster import ClusterPool
from skillwing.evaluation.campaign.flight_code import flight_code
from skillwing.evaluation.campaign.worker_pool import FlightPool, WorkerPool
from skillwing.evaluation.flights.conditions import Condition
from skillwing.evaluation.flights.plan import FlightPlan

code = cache(flight_code)
Opened = Callable[[ExitStack], FlightPool]


class PoolFigures(msgspec.Struct):
    """first: until the first result [wall s]. processor_time: of all flights and the pool [s]. memory: of the pool
    without its flights [MiB]. processes: their number beside the flights. closing: until no process is left, with
    flights under way [wall s].
    """

    first: float
    processor_time: float
    memory: float
    processes: int
    closing: float


def own_pool(stack: ExitStack) -> FlightPool:
    return stack.enter_context(WorkerPool(os.cpu_count() or 1))


def cluster_of(*, processes: bool) -> Opened:
    cores = os.cpu_count() or 1

    def open_cluster(stack: ExitStack) -> FlightPool:
        cluster = LocalCluster(
            n_workers=cores if processes else 1,
            threads_per_worker=1 if processes else cores,
            processes=processes,
            protocol="tcp://",
            dashboard_address="127.0.0.1:0",
        )
        stack.enter_context(cluster)
        return stack.enter_context(ClusterPool(cluster.scheduler_address, code(), partial(print, file=sys.stderr)))

    return open_cluster


POOLS: dict[str, Opened] = {
    "own pool": own_pool,
    "local cluster, workers as threads": cluster_of(processes=False),
    "local cluster, workers as processes": cluster_of(processes=True),
}


def main() -> None:
    parser = make_parser(__doc__)
    parser.add_argument("--flights", type=int, default=6)
    parser.add_argument("--only", choices=POOLS, help="measure one pool in this process, and print JSON")
    options = parser.parse_args()
    if options.only:
        sys.stdout.buffer.write(msgspec.json.encode(measured(POOLS[options.only], options.flights)))
        return
    figures = {name: in_process_of_its_own(name, options.flights) for name in POOLS}
    rows = [
        (
            name,
            f"{each.first:.1f} s",
            f"{each.processor_time:.0f} s",
            f"{each.memory:.0f} MiB",
            str(each.processes),
            f"{each.closing:.1f} s",
        )
        for name, each in figures.items()
    ]
    heads = ("pool", "first flight after", "processor time", "memory", "processes", "called off in")
    body = (
        f"{options.flights} flights that break off at their start, on all cores. Each flight is a process in every "
        "pool. Memory and processes are those of the pool without its flights. Processor time is that of everything. "
        f"{machine()}.\n\n" + table(heads, rows)
    )
    write_section("flight_pools.py", "Pools of flights on one machine", body, write=options.write)


def in_process_of_its_own(name: str, flights: int) -> PoolFigures:
    command = [sys.executable, str(Path(__file__)), "--only", name, "--flights", str(flights)]
    done = subprocess.run(command, check=True, stdout=subprocess.PIPE)
    return msgspec.json.decode(done.stdout, type=PoolFigures)


def measured(opened: Opened, flights: int) -> PoolFigures:
    code()  # a campaign computes it in any case
    memory_before, time_before = memory(), processor_time()
    begun = monotonic()
    with ExitStack() as stack:
        pool = opened(stack)
        results = pool.fly(plans(flights))
        next(results)
        first = monotonic() - begun
        for _ in results:
            pass
        used, spent = memory() - memory_before, processor_time() - time_before
        beside = len(psutil.Process().children(recursive=True))
        next(pool.fly(plans(flights)))  # the others are under way
        with timer() as closing:
            stack.close()
    return PoolFigures(first=first, processor_time=spent, memory=used, processes=beside, closing=closing())


def plans(count: int) -> list[FlightPlan]:
    return [
        FlightPlan(mission="none", world="courtyard", seed=seed, condition=Condition.NONE, label=str(seed))
        for seed in range(count)
    ]


def processor_time() -> float:
    """Processor time of this process and all that it started [s]."""
    here = psutil.Process()
    return sum(sum(each.cpu_times()[:4]) for each in (here, *here.children(recursive=True)))


def memory() -> float:
    """Memory that only this process and its children have [MiB]."""
    here = psutil.Process()
    return sum(each.memory_full_info().uss for each in (here, *here.children(recursive=True))) / 2**20


@contextmanager
def timer() -> Iterator[Callable[[], float]]:
    """Wall seconds of a block."""
    times = [monotonic()]
    yield lambda: times[-1] - times[0]
    times.append(monotonic())


if __name__ == "__main__":
    main()
