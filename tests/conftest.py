from __future__ import annotations

import signal
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import settings

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


@pytest.hookimpl(tryfirst=True)  # before xdist looks for the groups
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """For `pytest -n 2 --dist loadgroup`: each file stays whole, and each group of files with one worker."""
    if config.pluginmanager.has_plugin("xdist"):
        for item in items:
            file = item.path.relative_to(Path(__file__).parent).as_posix()
            item.add_marker(pytest.mark.xdist_group(GROUP_OF.get(file, file)))


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
