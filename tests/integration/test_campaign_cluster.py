"""A campaign on a Dask cluster of real processes: killed workers, workers of other code, and none at all."""

from __future__ import annotations

import os
import select
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Any

import pytest
import typer
from distributed import Client
from msgspec.structs import replace

from skillwing.evaluation.campaign import command
from skillwing.evaluation.campaign.cluster import ClusterError, ClusterPool
from skillwing.evaluation.campaign.command import make_plans
from skillwing.evaluation.campaign.flight_code import FlightCode, FlyingCode, flight_code
from skillwing.evaluation.campaign.ledger import LEDGER_FILE, read_results
from skillwing.evaluation.campaign.worker_pool import LostFlight, WorkerPool
from skillwing.evaluation.flights.plan import FlightPlan
from skillwing.evaluation.flights.result import FlightResult
from skillwing.services.errors import InvalidOptionError

pytestmark = [pytest.mark.slow, pytest.mark.timeout(300)]

DEATHS = 2
"""Number of workers that may die with one flight."""
PRELOAD = """
import sys
from functools import partial
from pathlib import Path
from skillwing.evaluation.campaign import cluster_worker as module
from skillwing.evaluation.campaign.flight_code import FlyingCode
from skillwing.evaluation.campaign.worker_pool import WorkerPool

flying = FlyingCode([Path({package!r})])
module._flying = lambda: flying
module.WorkerPool = partial(WorkerPool, worker=(sys.executable, "-c", {program!r}))
"""
"""Module that a worker loads at its start: it sets the program of flights, and the package whose code counts."""
WITHOUT_SKILLWING = """
import sys

sys.modules["skillwing"] = None
"""
FLIES_A_SECOND = """
import sys
from skillwing.evaluation import judged_flight
from skillwing.evaluation.campaign import worker
judged_flight.fly = lambda plan, run_dir, fly=judged_flight.fly: fly(plan, run_dir, longest=1.0)
worker.main(sys.argv[1:])
"""
SEED_0_LANDS_AT_ONCE = """
import json, sys
plan = json.loads(sys.argv[1])
if plan["seed"] == 0:
    print(json.dumps({"plan": plan, "end": "landed at home", "digest": "seed 0"}))
    sys.exit()
"""
FIRST_FLIGHT_OF_SEED_1_WAITS = """
import os
from pathlib import Path
tried = Path({fifo!r} + ".tried")
if plan["seed"] == 1 and not tried.exists():
    tried.touch()
    Path({fifo!r}).write_text(str(os.getppid()))
    sys.stdin.read()
    sys.exit(1)
"""
LANDS = """
import json, sys
print(json.dumps({"plan": json.loads(sys.argv[1]), "end": "landed at home"}))
"""
KILLS_ITS_WORKER = """
import json, os, sys
plan = json.loads(sys.argv[1])
if plan["seed"] == 0:
    os.kill(os.getppid(), 9)
print(json.dumps({"plan": plan, "end": "landed at home"}))
"""
WAITS = """
import os, sys
from pathlib import Path
Path({fifo!r}).write_text(str(os.getpid()))
sys.stdin.read()
"""
RECORDS = """
import json, sys
from pathlib import Path
plan = json.loads(sys.argv[1])
folder = Path(sys.argv[2]) / "steps"
folder.mkdir()
(folder / "1.txt").write_text(str(plan["seed"]))
print(json.dumps({"plan": plan, "end": "landed at home"}))
"""


@contextmanager
def started(*words: str, stderr: int = subprocess.DEVNULL) -> Iterator[subprocess.Popen[str]]:
    """`dask WORDS...` as a process, until the block ends."""
    options = ("--host", "127.0.0.1", "--dashboard-address", "127.0.0.1:0")
    environment = os.environ | {"DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": str(DEATHS - 1)}
    with subprocess.Popen(
        [sys.executable, "-m", "dask", *words, *options], stderr=stderr, text=True, env=environment
    ) as process:
        try:
            yield process
        finally:
            process.kill()


@contextmanager
def scheduler_started() -> Iterator[tuple[str, subprocess.Popen[str]]]:
    """Address and process of a scheduler without workers."""
    with started("scheduler", "--port", "0", stderr=subprocess.PIPE) as process:
        assert process.stderr is not None
        lines = (line.partition("Scheduler at:")[2].strip() for line in process.stderr)
        yield next(address for address in lines if address), process


@pytest.fixture(scope="module")
def scheduler() -> Iterator[str]:
    with scheduler_started() as (address, _):
        yield address


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """One in which a single file flies: its digest takes no time."""
    file = tmp_path / "package" / "m600" / "hover.py"
    file.parent.mkdir(parents=True)
    file.write_text("SECONDS = 2.0\n", encoding="utf-8")
    return tmp_path / "package"


@pytest.fixture
def fifo(tmp_path: Path) -> Path:
    """A pipe in which a flight says that it has begun."""
    os.mkfifo(tmp_path / "begun")
    return tmp_path / "begun"


Workers = Callable[..., Any]


@pytest.fixture
def workers(scheduler: str, tmp_path: Path) -> Workers:
    """Start workers whose flights are a program's, until the block ends."""

    @contextmanager
    def workers(
        count: int, program: str, package: Path, preload: str = PRELOAD
    ) -> Iterator[Sequence[subprocess.Popen[str]]]:
        file = tmp_path / "preload.py"
        file.write_text(preload.format(package=str(package), program=program), encoding="utf-8")
        words = ("worker", scheduler, "--no-nanny", "--nthreads", "1", "--preload", str(file))
        if not count:
            yield []
            return
        with (
            started(*words, "--local-directory", str(tmp_path / f"worker-{count}")) as process,
            workers(count - 1, program, package, preload) as others,
        ):
            yield [process, *others]

    return workers


def plans(count: int) -> list[FlightPlan]:
    return make_plans("mapping", f"0:{count}", "none", "courtyard")


def results_in(folder: Path) -> list[FlightResult]:
    """Results by seed, without the processor time that they took."""
    results = read_results(folder / LEDGER_FILE)
    return [replace(each, processor_time=0.0) for each in sorted(results, key=lambda each: each.plan.seed)]


def test_a_killed_worker_loses_no_flight_and_the_results_are_those_of_the_local_pool(
    scheduler: str, workers: Workers, package: Path, fifo: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The flight of the killed worker is a real one of a second."""
    monkeypatch.setattr(command, "FlyingCode", partial(FlyingCode, [package]))
    local = partial(WorkerPool, worker=(sys.executable, "-c", SEED_0_LANDS_AT_ONCE + FLIES_A_SECOND))
    monkeypatch.setattr(command, "WorkerPool", local)

    def fly(**options: Any) -> None:
        with pytest.raises(typer.Exit):
            command.campaign("mapping", seeds="0:2", faults="gust", as_json=True, **options)

    def kill() -> int:
        pid = int(fifo.read_text())
        os.kill(pid, signal.SIGKILL)
        return pid

    program = SEED_0_LANDS_AT_ONCE + FIRST_FLIGHT_OF_SEED_1_WAITS.format(fifo=str(fifo)) + FLIES_A_SECOND
    with workers(2, program, package) as processes, ThreadPoolExecutor() as threads:
        killed = threads.submit(kill)
        fly(cluster=scheduler, output=tmp_path / "cluster")
        (ended,) = [process for process in processes if process.pid == killed.result()]
        assert ended.wait() == -signal.SIGKILL
    fly(jobs=1, output=tmp_path / "local")
    here, there = results_in(tmp_path / "local"), results_in(tmp_path / "cluster")
    assert there == here
    assert [each.plan.seed for each in there] == [0, 1]
    assert all(each.digest and not each.error for each in there)


def test_a_flight_that_kills_each_worker_is_lost_and_the_others_are_flown(
    scheduler: str, workers: Workers, package: Path
) -> None:
    with workers(DEATHS + 1, KILLS_ITS_WORKER, package), ClusterPool(scheduler, flight_code([package]), print) as pool:
        (lost,) = pool.fly(plans(1))
        others = list(pool.fly(plans(3)[1:]))
    assert isinstance(lost, LostFlight)
    assert lost.why.startswith("2 workers died that had this flight, the last at tcp://127.0.0.1:")
    assert sorted(each.plan.seed for each in others if isinstance(each, FlightResult)) == [1, 2]


def test_recordings_come_back_from_a_worker_that_can_read_its_code_which_is_that_of_the_campaign(
    scheduler: str, workers: Workers, package: Path, tmp_path: Path
) -> None:
    code = flight_code([package])
    other = FlightCode(code.files | {"m600/hover.py": "other", "numpy": "1.0"})
    with workers(1, RECORDS, package):
        with (
            ClusterPool(scheduler, other, print) as pool,
            pytest.raises(InvalidOptionError, match=r"worker tcp://\S+ has other code: m600/hover\.py, numpy differ"),
        ):
            list(pool.fly(plans(2)))
        with ClusterPool(scheduler, code, print) as pool:
            flown = list(pool.fly(plans(2), lambda plan: tmp_path / plan.name))
            assert [type(each) for each in flown] == [FlightResult] * 2
            (package / "m600" / "gone.py").symlink_to("nowhere")
            with pytest.raises(
                ClusterError, match=r"worker tcp://\S+ cannot fly \(FileNotFoundError.* Install the same"
            ):
                list(pool.fly(plans(1)))
    recorded = [(tmp_path / each.plan.name / "steps" / "1.txt").read_text() for each in flown]
    assert sorted(recorded) == ["0", "1"]


def test_a_worker_without_skillwing_ends_the_campaign_with_a_sentence(
    scheduler: str, workers: Workers, package: Path
) -> None:
    with (
        workers(1, LANDS, package, preload=WITHOUT_SKILLWING),
        ClusterPool(scheduler, flight_code([package]), print) as pool,
        pytest.raises(ClusterError, match=r"cannot fly \(ModuleNotFoundError: .*skillwing.*Install the same Skillwing"),
    ):
        list(pool.fly(plans(1)))


def test_a_lost_scheduler_ends_the_campaign_with_a_sentence(package: Path) -> None:
    with scheduler_started() as (address, process), ClusterPool(address, flight_code([package]), print) as pool:
        with pytest.raises(ClusterError, match=rf"connection to the scheduler at {address} was lost\. Start the"):
            list(pool.fly(plans(1), check=process.kill))
        assert process.wait() == -signal.SIGKILL


def test_calling_a_campaign_off_ends_its_flights_on_the_cluster(
    scheduler: str, workers: Workers, package: Path, fifo: Path
) -> None:
    begun: list[int] = []

    checks = iter([False] * 3 + [True])  # three plans are queued, and then the flight of one has to begin

    def check() -> None:
        if next(checks):
            begun.append(os.pidfd_open(int(fifo.read_text())))
            raise KeyboardInterrupt

    with workers(1, WAITS.format(fifo=str(fifo)), package):
        with suppress(KeyboardInterrupt), ClusterPool(scheduler, flight_code([package]), print) as pool:
            list(pool.fly(plans(3), check=check))
        (process,) = begun
        assert select.select([process], [], []) == ([process], [], [])  # ready when the flight's process has ended
        os.close(process)
    with Client(scheduler, set_as_default=False) as client:
        assert client.run_on_scheduler(lambda dask_scheduler: list(dask_scheduler.tasks)) == []


def test_a_cluster_without_workers_is_reported(scheduler: str, package: Path) -> None:
    said: list[str] = []

    def call_off() -> None:
        if said:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt), ClusterPool(scheduler, flight_code([package]), said.append) as pool:
        list(pool.fly(plans(1), check=call_off))
    assert said == [
        "The cluster has no worker, and the campaign waits for one. "
        f"Start some by `dask worker {scheduler}`, or stop with Ctrl-C."
    ]
