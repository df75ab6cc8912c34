from __future__ import annotations

import signal
from collections.abc import Iterator

import pytest
from hypothesis import settings
from xdist.remote import Producer
from xdist.scheduler import LoadScopeScheduling

# How long an example takes tells nothing where the machine does other work as well.
settings.register_profile("skillwing", deadline=None, max_examples=50)
settings.register_profile("thorough", deadline=None, max_examples=1000)  # make thorough
settings.load_profile("skillwing")

GROUPS = {
    # Robots of many processes, and what has to be restarted in time: the one must not be started while the other waits.
    "systems": (
        "chaos/test_chaos.py",
        "integration/test_cli_commands.py",
        "integration/test_containers.py",
        "integration/test_demo.py",
        "integration/test_lockstep_flight.py",
        "integration/test_m600_fault_command.py",
        "integration/test_operations.py",
        "integration/test_point_drone.py",
        "integration/test_resource_manager_killed.py",
    ),
    "processes": (
        "fuzz/test_fuzz_processes.py",
        "history/test_resource_history.py",
        "integration/test_cli_processes.py",
        "integration/test_layouts.py",
        "integration/test_leases_zenoh.py",
        "integration/test_mock_command.py",
        "integration/test_plain_client.py",
        "integration/test_skillset_processes.py",
        "integration/test_system_ends.py",
        "integration/test_typed_clients_zenoh.py",
    ),
}
"""Files whose tests start processes. Those of a group run one after the other, as much of their time is waiting."""
GROUP_OF = {file: group for group, files in GROUPS.items() for file in files}


class WholeFiles(LoadScopeScheduling):
    """Keeps each file with one worker, so that what its tests share is made once, and each group of files.

    By the names of the files, for the mark `xdist_group` is without effect since pytest 9.2.
    """

    def _split_scope(self, nodeid: str) -> str:
        file = nodeid.partition("::")[0].removeprefix("tests/")
        return GROUP_OF.get(file, file)


@pytest.hookimpl(optionalhook=True)  # there is none where xdist is switched off
def pytest_xdist_make_scheduler(config: pytest.Config, log: Producer) -> WholeFiles | None:
    return WholeFiles(config, log) if config.getoption("dist") == "loadfile" else None


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
