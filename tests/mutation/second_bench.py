"""Judges mutants that no unit test has killed, on whole managers in one process: reads their names, a line each.

Runs in a workspace that `mutation_run.py` has made, with its mutants first on the path. Prints a name and the first
failing test, or nothing, as soon as it is known.
"""

from __future__ import annotations

import os
import signal
import sys
from importlib import import_module

import pytest

BENCH = (
    # These come by every function only through what they keep, or are younger than mutmut's verdict.
    "tests/unit/services/test_going_on.py",
    "tests/unit/services/test_leases.py",
    "tests/unit/services/test_resource_core.py",
    "tests/integration/test_managers_in_process.py",
    "tests/integration/test_leases_and_owners.py",
    "tests/integration/test_resource_manager_restart.py",
    "tests/simulation/test_simulation.py::test_promises_are_kept[0]",
)
LOADED_BEFORE = ("simulation.campaign", "skillwing.services.mocking.system", "skillwing.services.testing")
"""What every process would have to import anew."""
PATIENCE = 240
"""Wall seconds after which a mutant counts as killed, for it runs in circles."""


class FirstFailure:
    """Remembers which test failed first."""

    def __init__(self) -> None:
        self.test = ""

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.failed and not self.test:
            self.test = report.nodeid


def judge(name: str) -> None:
    """Run the bench with one mutant; prints a line."""
    failure = FirstFailure()
    os.environ["MUTANT_UNDER_TEST"] = name
    out = os.dup(1)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    os.dup2(nowhere, 2)
    code = pytest.main(["-x", "-q", "-p", "no:cacheprovider", "-p", "no:randomly", *BENCH], plugins=[failure])
    told = failure.test or ("" if code == pytest.ExitCode.OK else f"exit code {int(code)}")
    os.write(out, f"{name}\t{told}\n".encode())


def main() -> None:
    for name in LOADED_BEFORE:
        import_module(name)
    for line in sys.stdin:
        name = line.strip()
        child = os.fork()
        if child == 0:
            signal.alarm(PATIENCE)
            judge(name)
            os._exit(0)
        _, status = os.waitpid(child, 0)
        if os.WIFSIGNALED(status):
            sys.stdout.write(f"{name}\ttimeout\n")
            sys.stdout.flush()


if __name__ == "__main__":
    main()
