from __future__ import annotations

import gc
import os
import signal
from collections.abc import Generator, Iterator
from typing import TYPE_CHECKING

import pytest
from hypothesis import settings

from scheduling import scope_of, starts_processes

if TYPE_CHECKING:
    from xdist.remote import Producer
    from xdist.scheduler import LoadScopeScheduling

# How long an example takes tells nothing where the machine does other work as well.
settings.register_profile("skillwing", deadline=None, max_examples=25)
settings.register_profile("thorough", deadline=None, max_examples=1000)  # make thorough
settings.load_profile("skillwing")

# A worker holds half a million objects that live to its end: tests, modules, syntax trees. With 700 new objects between
# two collections, as usual, a sixth of the processor time of flights is spent on looking through them again.
gc.set_threshold(20_000)
gc.disable()  # until the tests are known: see pytest_collection

LOWER_PRIORITY = 10
"""Niceness of workers that calculate."""


@pytest.hookimpl(wrapper=True, optionalhook=True)  # there is none where xdist is switched off, or not installed
def pytest_xdist_auto_num_workers() -> Generator[None, int, int]:
    """One worker a core, and two more: tests that start processes wait for much of their time."""
    cores = yield
    return cores + 2


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Producer) -> LoadScopeScheduling | None:
    """Keep each file with one worker, so that what its tests share is made once, and each group of files.

    By the names of the files, for the mark `xdist_group` is without effect since pytest 9.2.
    """
    if config.getoption("dist") != "loadfile":
        return None
    from xdist.scheduler import LoadScopeScheduling  # noqa: PLC0415 - there need not be one

    class WholeFiles(LoadScopeScheduling):
        def _split_scope(self, nodeid: str) -> str:
            return scope_of(nodeid)

    return WholeFiles(config, log)


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Collect without garbage collection. What exists then is never looked through again."""
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


@pytest.hookimpl(trylast=True)  # pytest sorts by fixtures before
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with the groups: they take longest, and those that calculate fill the rest of the time of all workers."""
    items.sort(key=lambda item: not starts_processes(item.nodeid))


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Give way to the processes that other workers start and that must answer in time."""
    if "PYTEST_XDIST_WORKER" in os.environ and not starts_processes(item.nodeid) and os.nice(0) < LOWER_PRIORITY:
        os.nice(LOWER_PRIORITY)


@pytest.fixture(scope="session", autouse=True)
def signals_reach_what_tests_start() -> Iterator[None]:
    """`nohup` and `&` have the tests ignore signals, and with them every process that a test starts and wants to end.

    A handler that does nothing is as good for the tests, and is not handed on.
    """
    ignored = [
        each for each in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP) if signal.getsignal(each) is signal.SIG_IGN
    ]
    for number in ignored:
        signal.signal(number, lambda _number, _frame: None)
    yield
    for number in ignored:
        signal.signal(number, signal.SIG_IGN)


@pytest.fixture(scope="session", autouse=True)
def systems_of_others_are_not_found(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """A system that runs on this machine is that of its user: no command of a test finds it."""
    runtime = tmp_path_factory.mktemp("runtime")
    runtime.chmod(0o700)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_RUNTIME_DIR", str(runtime))
        for name in ("SKILLWING_CONNECT", "SKILLWING_ROBOT"):
            patch.delenv(name, raising=False)
        yield
