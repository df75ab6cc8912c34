"""Judges mutants: `python bench.py TEST...` reads their names, a line each, in a workspace that `mutants.py` has made.

Prints a name and the test that killed it, or nothing. First the tests run once without mutants, which shows their
durations and the functions that they call. Then each mutant gets a process of its own, forked from this one. It meets
the tests that call its function, the fastest first.
"""

from __future__ import annotations

import os
import resource
import signal
import sys
import time
from collections.abc import Iterable, Sequence
from typing import Any

import pytest
from mutmut.mutation import trampoline

MUTANT = "MUTANT_UNDER_TEST"
STATS = "stats"
"""Value of the variable with which every function that has mutants reports its calls."""
CIRCLING = 5.0
"""Processor seconds beyond ten times those of its tests. A mutant that needs more counts as endless and is killed."""
HANGING = 900
"""Wall seconds after which a mutant counts as hung and is killed."""


class Bench:
    """A pytest plugin that replaces the loop over the tests."""

    def __init__(self, mutants: Iterable[str], out: int) -> None:
        self._mutants = mutants
        self._out = out
        self._failed = ""
        self._seconds: dict[pytest.Item, float] = {}
        self._functions: dict[pytest.Item, set[str]] = {}

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.failed and not self._failed:
            self._failed = report.nodeid

    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        if session.testsfailed:
            return False
        self._rehearse(session.items)
        for line in self._mutants:
            self._judge(line.strip())
        return True

    def _rehearse(self, items: Sequence[pytest.Item]) -> None:
        called: set[str] = set()
        trampoline.record_trampoline_hit = lambda name, caller=None: called.add(name)  # pyright: ignore
        os.environ[MUTANT] = STATS
        for item in items:
            called.clear()
            began = time.process_time()
            self._run(item)
            self._seconds[item], self._functions[item] = time.process_time() - began, set(called)
            if self._failed:
                raise pytest.UsageError(f"{self._failed} fails without any mutant")

    def _judge(self, mutant: str) -> None:
        function = mutant.partition("__mutmut_")[0]
        items = sorted(
            (item for item, functions in self._functions.items() if function in functions),
            key=self._seconds.__getitem__,
        )
        child = os.fork()
        if child == 0:
            limit = int(CIRCLING + 10 * sum(self._seconds[item] for item in items))
            resource.setrlimit(resource.RLIMIT_CPU, (limit, limit))
            signal.alarm(HANGING)
            os.environ[MUTANT] = mutant
            for item in items:
                self._run(item)
                if self._failed:
                    break
            self._tell(mutant, self._failed)
            os._exit(0)
        _, status = os.waitpid(child, 0)
        if status != 0:
            self._tell(mutant, f"signal {os.WTERMSIG(status)}")

    def _run(self, item: pytest.Item) -> None:
        item.config.hook.pytest_runtest_protocol(item=item, nextitem=None)

    def _tell(self, mutant: str, killer: str) -> None:
        os.write(self._out, f"{mutant}\t{killer}\n".encode())


def main(tests: Sequence[str]) -> Any:
    # Output of tests is dropped, and pytest must not read the names from the standard input.
    names, out, errors = os.fdopen(os.dup(0)), os.dup(1), os.dup(2)
    nowhere = os.open(os.devnull, os.O_RDWR)
    os.dup2(nowhere, 0)
    os.dup2(nowhere, 1)
    os.environ[MUTANT] = ""
    arguments = ["-q", "-p", "no:cacheprovider", "-p", "no:randomly", "-p", "no:xdist", "-p", "no:timeout"]
    code = pytest.main([*arguments, *tests], plugins=[Bench(names, out)])
    os.write(errors, b"" if code == pytest.ExitCode.OK else f"The bench ended with {code!r}.\n".encode())
    return code


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
